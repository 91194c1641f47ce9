"""Topics that all nodes share, and what ordinary verbs do with nodes of the other side."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Header
from actors.parameters.types import Parameter
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.graphs import nodes_until
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair
    from tests.ros2.ros import RosSubscription

ROSOUT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
EVENTS = QoSProfile(depth=1000)


async def _lines(subscription: RosSubscription, last: str) -> list[Log]:
    """Wait for a line; return all."""
    for count in range(1, 10_000):
        found = await subscription.received(count)
        if any(each.msg == last for each in found):
            return found
    raise AssertionError(last)


async def test_each_line_of_rosout_is_there_once_with_its_own_name(pair: Pair) -> None:
    """Both sides read the lines of both."""
    here: list[Log] = []
    pair.here.create_subscription(Log, "/rosout", here.append, ROSOUT)
    there = await pair.there.subscription("/rosout", Log, ROSOUT)
    names = [f"{pair.name[1:]}_{side}" for side in ("here", "there")]
    for text in ("line", "last"):
        pair.here.get_logger().info(f"{pair.name} {text} of callboard")
        await pair.there.ask("log", f"{pair.name} {text} of ROS")
        await until(lambda: any(each.msg == f"{pair.name} {text} of ROS" for each in here))  # noqa: B023
        await _lines(there, f"{pair.name} {text} of callboard")
    for lines in (here, await there.received(1)):
        found = sorted(
            (each.msg.removeprefix(f"{pair.name} "), each.name) for each in lines if pair.name in each.msg
        )
        assert found == [
            ("last of ROS", names[1]),
            ("last of callboard", names[0]),
            ("line of ROS", names[1]),
            ("line of callboard", names[0]),
        ]


async def test_parameter_events_cross_with_their_own_name(pair: Pair) -> None:
    """Each side gets those of the other's nodes; those that mirrors cannot avoid do not cross."""
    here: list[ParameterEvent] = []
    pair.here.create_subscription(ParameterEvent, "/parameter_events", here.append, EVENTS)
    there = await pair.there.subscription("/parameter_events", ParameterEvent, EVENTS)
    pair.here.declare_parameter("speed", 1)
    node = await pair.ros.node(f"{pair.name[1:]}_robot", speed=1)
    await nodes_until(pair.here, node.name)
    # An event is lost where nobody has matched yet, as between nodes of ROS.
    for value in range(2, 1000):
        pair.here.set_parameters([Parameter("speed", value=value)])
        await node.ask("set_parameter", "speed", value)
        await asyncio.sleep(0)
        mine = [each for each in await there.received(0) if each.node == f"{pair.name}_here"]
        if mine and any(each.node == node.name for each in here):
            break
    names = {each.node for each in await there.received(1)} | {each.node for each in here}
    assert not [each for each in names if "callboard_bridge" in each]


async def test_time_of_ros_is_time_here(pair: Pair) -> None:
    """/clock crosses."""
    received: list[Clock] = []
    publisher = await pair.there.publisher("/clock", Clock)
    pair.here.create_subscription(Clock, "/clock", received.append, 10)
    await publisher.matched()
    message = Clock()
    message.clock.sec = 1234
    await publisher.publish(message)
    await until(lambda: received)
    assert received == [message]


async def test_latched_transforms_of_all_publishers_arrive(pair: Pair) -> None:
    """Several nodes of ROS latch on one topic, as on /tf_static: late subscriptions get all."""
    topic = f"{pair.name}/tf_static"
    sent = [TransformStamped(header=Header(frame_id=f"frame_{number}")) for number in range(3)]
    for number, each in enumerate(sent):
        node = await pair.ros.node(f"{pair.name[1:]}_tf_{number}")
        await (await node.publisher(topic, TransformStamped, LATCHED)).publish(each)
    received: list[TransformStamped] = []
    static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    pair.here.create_subscription(TransformStamped, topic, received.append, static)
    await until(lambda: len(received) >= len(sent))
    assert sorted(each.header.frame_id for each in received) == [each.header.frame_id for each in sent]


async def test_latched_transforms_of_callboard_arrive(pair: Pair) -> None:
    """Several nodes here latch on one topic: a late subscription of ROS gets each one's message."""
    topic = f"{pair.name}/tf_static_here"
    sent = [TransformStamped(header=Header(frame_id=f"frame_{number}")) for number in range(3)]
    for number, each in enumerate(sent):
        bare = pair.here.create_bare_node(f"{pair.name[1:]}_tf_{number}")
        bare.create_publisher(TransformStamped, topic, LATCHED).publish(each)
    static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    subscription = await pair.there.subscription(topic, TransformStamped, static)
    found = await subscription.received(len(sent))
    assert sorted(each.header.frame_id for each in found) == [each.header.frame_id for each in sent]


async def test_parameters_of_ros_by_ordinary_verbs(pair: Pair) -> None:
    """`param get` and `param set` work for a node of ROS."""
    node = await pair.ros.node(f"{pair.name[1:]}_robot", speed=1)
    await nodes_until(pair.here, node.name)
    process = pair.network.callboard("param", "set", node.name, "speed", "7")
    assert await asyncio.to_thread(process.wait) == 0, process.output()
    assert await node.ask("parameter", "speed") == 7
    process = pair.network.callboard("param", "get", node.name, "speed")
    assert await asyncio.to_thread(process.wait) == 0
    assert "7" in process.output()
