"""Types that only one side has."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.interfaces.std_msgs.msg import Int64, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.ros2.graphs import endpoints_until
from tests.ros2.ros import interface
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair


async def test_a_type_that_callboard_lacks_is_echoed(pair: Pair) -> None:
    """Its definition comes from ROS's packages, and a command that has no class for it prints messages."""
    cls: Any = interface("test_msgs/msg/BasicTypes")
    publisher = await pair.there.publisher(f"{pair.name}/basic", cls)
    await endpoints_until(pair.here, "publishers", f"{pair.name}/basic", 1)
    process = pair.network.callboard("topic", "echo", f"{pair.name}/basic", "--once")
    await publisher.matched()
    await publisher.publish(cls(int32_value=123456))
    assert await asyncio.to_thread(process.wait) == 0, process.output()
    assert "123456" in process.output()


async def test_a_type_that_ros_lacks_is_named(pair: Pair) -> None:
    """The report has the topic, the type, and the package to install."""
    pair.here.create_publisher(TFMessage, f"{pair.name}/tf", 10)
    output = ""
    while f"{pair.name}/tf" not in output:
        process = pair.network.callboard("bridge", "info")
        await asyncio.to_thread(process.wait)  # not 0 as long as the bridge starts
        output = process.output()
    assert "tf2_msgs" in output


async def test_the_second_type_of_a_topic_does_not_cross(pair: Pair) -> None:
    """The first one goes on."""
    topic = f"{pair.name}/two_types"
    received: list[String] = []
    publisher = await pair.there.publisher(topic, String)
    pair.here.create_subscription(String, topic, received.append, 10)
    await publisher.matched()
    bare = pair.here.create_bare_node(f"{pair.name[1:]}_other")
    bare.create_publisher(Int64, topic, 10).publish(Int64(data=1))
    await publisher.publish(String(data="first"))
    await until(lambda: received == [String(data="first")])


async def test_a_topic_gets_another_type(pair: Pair) -> None:
    """What was shown of the old type lingers, so that ROS 2 refuses the new one at first."""
    topic = f"{pair.name}/retyped"
    old = pair.here.create_publisher(String, topic, 10)
    await pair.there.endpoints(topic, "publishers", 1)
    for _ in range(3):
        old.publish(String(data="old"))
    await old.flush()
    old.destroy()
    new = pair.here.create_publisher(Int64, topic, 10)
    subscription = await pair.there.subscription(topic, Int64)
    await new.wait_for_subscriptions()
    await subscription.matched()
    new.publish(Int64(data=1))
    assert await subscription.received(1) == [Int64(data=1)]
