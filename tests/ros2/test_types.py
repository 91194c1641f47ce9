"""Types that only one side has."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import Int64, String, UInt16
from actors.interfaces.std_srvs.srv import Empty
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.graphs import endpoints_until, wait_for_refusal
from tests.ros2.ros import interface
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class OtherUInt16(actors.Message, type_name="std_msgs/msg/UInt16"):
    """A type of ROS, with another definition."""

    data: int = 0
    unit: str = ""


class OtherEmpty(actors.Service, type_name="std_srvs/srv/Empty"):
    """A service of ROS, with another definition."""

    class Request(actors.Message):
        reason: str = ""

    class Response(actors.Message):
        pass


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
    await wait_for_refusal(pair.here, f"{pair.name}/tf", "type missing", "tf2_msgs")


async def test_topics_and_services_with_another_hash_are_refused(pair: Pair) -> None:
    """Both hashes are named, and the node that has the other definition; nodes with the usual one go on."""
    topic, service = f"{pair.name}/number", f"{pair.name}/trigger"
    other = pair.here.create_bare_node(f"{pair.name[1:]}_other")
    publisher = await pair.there.publisher(topic, UInt16)
    await pair.there.service(service, Empty, Empty.Response())
    other.create_subscription(OtherUInt16, topic, print, 10)
    other.create_client(OtherEmpty, service)
    for name, changed, usual in ((topic, OtherUInt16, UInt16), (service, OtherEmpty, Empty)):
        parts = type_hash(changed), type_hash(usual), f"{pair.name}_other"
        await wait_for_refusal(pair.here, name, "type differs", *parts)
    received: list[UInt16] = []
    pair.here.create_subscription(UInt16, topic, received.append, 10)
    await publisher.matched()
    await publisher.publish(UInt16(data=7))
    await until(lambda: received == [UInt16(data=7)])
    client = pair.here.create_client(Empty, service)
    assert await client.wait_for_service()
    await client.call(Empty.Request())
    # The other way round: what is published here in another definition does not reach ROS.
    listener = await pair.there.subscription(f"{topic}_here", UInt16)
    other.create_publisher(OtherUInt16, f"{topic}_here", LATCHED).publish(OtherUInt16(data=1, unit="m"))
    await wait_for_refusal(pair.here, f"{topic}_here", "type differs", type_hash(OtherUInt16))
    pair.here.create_publisher(UInt16, f"{topic}_here", LATCHED).publish(UInt16(data=2))
    assert await listener.received(1) == [UInt16(data=2)]


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
