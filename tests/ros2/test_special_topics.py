"""Topics that all nodes share, and what ordinary verbs do with nodes of the other side."""

from __future__ import annotations

import asyncio
import itertools
from typing import TYPE_CHECKING

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Header
from actors.parameters.types import Parameter
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.graphs import POLL_SEC, endpoints_until, full_name, nodes_until, wait_for_refusal
from tests.ros2.ros import WAIT_SEC
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair

ROSOUT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
EVENTS = QoSProfile(depth=1000)
TRANSFORMS = QoSProfile(depth=100)


async def test_each_line_of_rosout_is_there_once_with_its_own_name(pair: Pair) -> None:
    """Both sides read the lines of both."""
    here: list[Log] = []
    pair.here.create_subscription(Log, "/rosout", here.append, ROSOUT)
    there = await pair.there.subscription("/rosout", Log, ROSOUT)
    ours, theirs = [f"{pair.name[1:]}_{side}" for side in ("here", "there")]
    wanted = [(f"{pair.name} {text}", name) for text in ("first", "last") for name in (ours, theirs)]

    def mine(lines: list[Log]) -> list[tuple[str, str]]:
        return [(each.msg, each.name) for each in lines if each.msg.startswith(f"{pair.name} ")]

    for text, name in wanted:
        if name == ours:
            pair.here.get_logger().info(text)
        else:
            await pair.there.ask("log", text)
        # Lines of different nodes may arrive in any order: one follows when the last is on both sides.
        await until(lambda: (text, name) in mine(here), f"{text} of {name} in callboard")  # noqa: B023
        async with asyncio.timeout(WAIT_SEC):
            while (text, name) not in mine(await there.received(0)):
                await asyncio.sleep(POLL_SEC)
    assert mine(here) == mine(await there.received(0)) == wanted


async def test_parameter_events_cross_with_their_own_name(pair: Pair) -> None:
    """Each side gets those of the other's nodes; those that mirrors cannot avoid do not cross."""
    here: list[ParameterEvent] = []
    pair.here.create_subscription(ParameterEvent, "/parameter_events", here.append, EVENTS)
    there = await pair.there.subscription("/parameter_events", ParameterEvent, EVENTS)
    pair.here.declare_parameter("speed", 1)
    node = await pair.ros.node(f"{pair.name[1:]}_robot", speed=1)
    await nodes_until(pair.here, node.name)
    async with asyncio.timeout(WAIT_SEC):
        for value in itertools.count(2):  # an event is lost where nobody has matched yet, as within ROS
            pair.here.set_parameters([Parameter("speed", value=value)])
            await node.ask("set_parameter", "speed", value)
            await asyncio.sleep(POLL_SEC)
            mine = [each for each in await there.received(0) if each.node == f"{pair.name}_here"]
            if mine and any(each.node == node.name for each in here):
                break
    # A subscription in ROS may also get events of the bridge's own nodes, by ROS's way.
    assert not [each.node for each in here if "callboard_bridge" in each.node]


async def test_time_of_ros_is_time_here(pair: Pair) -> None:
    """/clock crosses."""
    received: list[Clock] = []
    publisher = await pair.there.publisher("/clock", Clock)
    pair.here.create_subscription(Clock, "/clock", received.append, 10)
    await publisher.matched()
    message = Clock()
    message.clock.sec = 1234
    async with asyncio.timeout(WAIT_SEC):
        while not received:  # the source of another test may have the time for a moment
            await publisher.publish(message)
            await asyncio.sleep(POLL_SEC)
    assert received[0] == message


async def test_a_second_clock_of_ros_does_not_cross(pair: Pair) -> None:
    """Time has one source: the node whose time does not cross is named."""
    received: list[int] = []
    first, second = [await pair.ros.node(f"{pair.name[1:]}_clock_{number}") for number in (1, 2)]
    publishers = [await each.publisher("/clock", Clock) for each in (first, second)]
    text = f"{first.name} publishes the time: the time of {second.name} does not cross"
    await wait_for_refusal(pair.here, "/clock", "second clock", text)
    pair.here.create_subscription(Clock, "/clock", lambda each: received.append(each.clock.sec), 10)
    for each in reversed(publishers):
        await each.matched()
    for sec in (100, 101):
        await publishers[1].publish(Clock(clock=Time(sec=sec + 100)))
        await publishers[0].publish(Clock(clock=Time(sec=sec)))
        await until(lambda: sec in received)  # noqa: B023
    assert received == [100, 101]
    assert [full_name(each) for each in await endpoints_until(pair.here, "publishers", "/clock", 1)] == [
        first.name
    ]


async def test_clocks_of_both_sides_stay_there(pair: Pair) -> None:
    """Each side keeps its own time, and the report says so; the time crosses again when one has ended."""
    there = await pair.there.publisher("/clock", Clock)
    bare = pair.here.create_bare_node(f"{pair.name[1:]}_clock")
    received: list[int] = []
    pair.here.create_subscription(Clock, "/clock", lambda each: received.append(each.clock.sec), 10)
    own = bare.create_publisher(Clock, "/clock", 10)
    text = "both sides publish the time: each side keeps its own"
    await wait_for_refusal(pair.here, "/clock", "second clock", text)
    shown = await endpoints_until(pair.here, "publishers", "/clock", 1)
    assert [full_name(each) for each in shown] == [f"{pair.name}_clock"]
    [[node, *_]] = await pair.there.endpoints("/clock", "publishers", 1)
    assert node == pair.there.name
    await pair.there.endpoints("/clock", "subscriptions", 0)
    own.publish(Clock(clock=Time(sec=100)))
    await until(lambda: received == [100])
    bare.destroy()
    await there.matched()
    await there.publish(Clock(clock=Time(sec=201)))
    await until(lambda: received == [100, 201])


async def test_latched_transforms_of_all_publishers_arrive(pair: Pair) -> None:
    """Several nodes of each side latch on /tf_static: late subscriptions of both get all, each once.

    ROS's wheels have no tf2_msgs, and rclpy needs compiled code for each type: so the type is another one
    that both sides have. The bridge treats all types alike.
    """
    sent: list[str] = []
    for number in range(3):
        node = await pair.ros.node(f"{pair.name[1:]}_there_{number}")
        bare = pair.here.create_bare_node(f"{pair.name[1:]}_here_{number}")
        sent += node.name, f"{pair.name}_here_{number}"
        there = await node.publisher("/tf_static", TransformStamped, LATCHED)
        await there.publish(TransformStamped(header=Header(frame_id=node.name)))
        here = bare.create_publisher(TransformStamped, "/tf_static", LATCHED)
        here.publish(TransformStamped(header=Header(frame_id=f"{pair.name}_here_{number}")))
    static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)

    def mine(transforms: list[TransformStamped]) -> list[str]:
        names = sorted(each.header.frame_id for each in transforms)
        return [each for each in names if each.startswith(f"{pair.name}_")]

    for _ in range(2):  # the second time all has crossed already, and mirrors keep it
        received: list[TransformStamped] = []
        pair.here.create_subscription(TransformStamped, "/tf_static", received.append, static)
        subscription = await pair.there.subscription("/tf_static", TransformStamped, static)
        await until(lambda: len(mine(received)) >= len(sent))  # noqa: B023
        async with asyncio.timeout(WAIT_SEC):
            while len(mine(await subscription.received(0))) < len(sent):
                await asyncio.sleep(POLL_SEC)
        assert mine(received) == mine(await subscription.received(0)) == sorted(sent)


async def test_transforms_cross_both_ways(pair: Pair) -> None:
    """What a node of each side publishes on /tf arrives on both sides, in order."""
    names, numbers = [f"{pair.name}_here", pair.there.name], [str(number) for number in range(20)]
    here: list[TransformStamped] = []
    pair.here.create_subscription(TransformStamped, "/tf", here.append, TRANSFORMS)
    there = await pair.there.subscription("/tf", TransformStamped, TRANSFORMS)
    own = pair.here.create_publisher(TransformStamped, "/tf", TRANSFORMS)
    theirs = await pair.there.publisher("/tf", TransformStamped, TRANSFORMS)

    def transforms(name: str, children: list[str]) -> list[TransformStamped]:
        return [TransformStamped(header=Header(frame_id=name), child_frame_id=each) for each in children]

    async def publish(children: list[str]) -> None:
        for each in transforms(names[0], children):
            own.publish(each)
        await theirs.publish(*transforms(names[1], children))

    async def have_arrived(child: str) -> bool:
        return all(
            {*names} <= {each.header.frame_id for each in received if each.child_frame_id == child}
            for received in (here, await there.received(0))
        )

    async with asyncio.timeout(WAIT_SEC):
        while not await have_arrived("first"):  # some are lost where nobody has matched yet, as within ROS
            await publish(["first"])
            await asyncio.sleep(POLL_SEC)
        await publish(numbers)
        while not await have_arrived(numbers[-1]):
            await asyncio.sleep(POLL_SEC)
    for received in (here, await there.received(0)):
        for name in names:
            mine = [each.child_frame_id for each in received if each.header.frame_id == name]
            assert [each for each in mine if each != "first"] == numbers


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
