"""Messages cross in both directions, while somebody on the other side wants them."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces import cdr
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.sensor_msgs.msg import Image, JointState
from actors.interfaces.std_msgs.msg import Int64, String
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.interfaces.random_messages import random_message
from tests.ros2.graphs import endpoints_until
from tests.waiting import until

if TYPE_CHECKING:
    import actors
    from tests.ros2.conftest import Pair

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
COUNT = 5
"""Messages of a kind: fewer than the depth, so that all arrive."""


def messages_of(cls: Any) -> list[Any]:
    """Return messages with random values."""
    random = Random(cls.__name__)
    return [random_message(cls, random) for _ in range(COUNT)]


@pytest.mark.parametrize("cls", [String, JointState, PoseStamped])
async def test_messages_of_ros_arrive_as_they_were(cls: Any, pair: Pair) -> None:
    """All of them, in order, with the values that they had."""
    topic, sent = f"{pair.name}/to_here", messages_of(cls)
    received: list[Any] = []
    publisher = await pair.there.publisher(topic, cls)
    subscription = pair.here.create_subscription(cls, topic, received.append, 10)
    await publisher.matched()
    await until(lambda: subscription.get_publisher_count() == 1)
    await publisher.publish(*sent)
    await until(lambda: len(received) == COUNT)
    assert received == sent


@pytest.mark.parametrize("cls", [String, JointState, PoseStamped])
async def test_messages_of_callboard_arrive_as_they_were(cls: Any, pair: Pair) -> None:
    """All of them, in order, with the values that they had."""
    topic, sent = f"{pair.name}/to_there", messages_of(cls)
    subscription = await pair.there.subscription(topic, cls)
    publisher = pair.here.create_publisher(cls, topic, 10)
    await publisher.wait_for_subscriptions()
    await subscription.matched()
    for each in sent:
        publisher.publish(each)
    assert await subscription.received(COUNT) == sent


def large_image(config: pytest.Config) -> Image:
    """Return an image of a megabyte; `make nightly` has one of more than 8 MiB."""
    height = 8200 if config.getoption("--nightly") else 1024
    data = bytes(range(256)) * (height * 4)
    return Image(height=height, width=1024, encoding="mono8", step=1024, data=data)


async def test_large_messages_cross_both_ways(pair: Pair, pytestconfig: pytest.Config) -> None:
    """One of a megabyte is one message. `make nightly` sends 8 MiB."""
    image = large_image(pytestconfig)
    topic = f"{pair.name}/image"
    received: list[Image] = []
    publisher = await pair.there.publisher(f"{topic}_to_here", Image)
    pair.here.create_subscription(Image, f"{topic}_to_here", received.append, 10)
    subscription = await pair.there.subscription(f"{topic}_to_there", Image)
    own = pair.here.create_publisher(Image, f"{topic}_to_there", 10)
    await publisher.matched()
    await own.wait_for_subscriptions()
    await subscription.matched()
    await publisher.publish(image)
    own.publish(image)
    await until(lambda: received)
    assert received == [image]
    assert await subscription.received(1) == [image]


async def test_large_latched_messages_cross_both_ways(pair: Pair, pytestconfig: pytest.Config) -> None:
    """A map is published once, before anybody listens, and waits for mirrors. `make nightly` sends 8 MiB."""
    image = large_image(pytestconfig)
    topic = f"{pair.name}/map"
    received: list[Image] = []
    publisher = await pair.there.publisher(f"{topic}_to_here", Image, LATCHED)
    await publisher.publish(image)
    own = pair.here.create_publisher(Image, f"{topic}_to_there", LATCHED)
    own.publish(image)
    pair.here.create_subscription(Image, f"{topic}_to_here", received.append, LATCHED)
    subscription = await pair.there.subscription(f"{topic}_to_there", Image, LATCHED)
    assert await subscription.received(1) == [image]
    await until(lambda: received)
    assert received == [image]


async def test_surplus_bytes_of_ros_are_left_behind(pair: Pair) -> None:
    """Writers of CDR may add some: the message before them arrives."""
    topic = f"{pair.name}/surplus"
    received: list[String] = []
    publisher = await pair.there.publisher(topic, String)
    pair.here.create_subscription(String, topic, received.append, 10)
    await publisher.matched()
    await publisher.publish_raw(cdr.encode(String(data="text")) + bytes(8))
    await until(lambda: received)
    assert received == [String(data="text")]


async def test_the_stamp_of_the_source_is_kept(pair: Pair) -> None:
    """A message of ROS arrives with the time at which it was published there."""
    topic = f"{pair.name}/stamped"
    received: list[actors.MessageInfo] = []
    publisher = await pair.there.publisher(topic, Int64)
    witness = await pair.there.subscription(topic, Int64)

    def arrived(_: Int64, info: actors.MessageInfo) -> None:
        received.append(info)

    pair.here.create_subscription(Int64, topic, arrived, 10)
    await publisher.matched(2)
    await publisher.publish(*[Int64(data=number) for number in range(COUNT)])
    await until(lambda: len(received) == COUNT)
    stamps = [stamp for _, stamp in await witness.received_with_stamps(COUNT)]
    assert [each.source_timestamp for each in received] == stamps
    assert {each.publisher_node for each in received} == {pair.there.name}


async def test_a_topic_of_ros_is_received_on_demand(pair: Pair) -> None:
    """The bridge subscribes in ROS while a node here does."""
    topic = f"{pair.name}/wanted_here"
    publisher = await pair.there.publisher(topic, String)
    await endpoints_until(pair.here, "publishers", topic, 1)
    await publisher.matched(0)
    first, second = [pair.here.create_subscription(String, topic, print, 10) for _ in range(2)]
    await publisher.matched(1)
    first.destroy()
    second.destroy()
    await publisher.matched(0)


async def test_a_topic_of_callboard_is_received_on_demand(pair: Pair) -> None:
    """The bridge subscribes here while a node of ROS does."""
    topic = f"{pair.name}/wanted_there"
    publisher = pair.here.create_publisher(String, topic, 10)
    await pair.there.endpoints(topic, "publishers", 1)
    assert publisher.get_subscription_count() == 0
    subscription = await pair.there.subscription(topic, String)
    await publisher.wait_for_subscriptions(1)
    await subscription.destroy()
    await until(lambda: publisher.get_subscription_count() == 0)


async def test_messages_come_from_the_mirror_of_their_node(pair: Pair) -> None:
    """Two nodes of ROS publish on one topic: each message has its own node's name."""
    topic = f"{pair.name}/shared"
    other = await pair.ros.node(f"{pair.name[1:]}_other")
    received: dict[str, str] = {}

    def arrived(message: String, info: actors.MessageInfo) -> None:
        received[message.data] = info.publisher_node

    pair.here.create_subscription(String, topic, arrived, 10)
    for node in (pair.there, other):
        publisher = await node.publisher(topic, String)
        await publisher.matched()
        await publisher.publish(String(data=node.name))
    await until(lambda: len(received) == 2)
    assert received == {pair.there.name: pair.there.name, other.name: other.name}


async def test_several_publishers_of_callboard_reach_ros_once(pair: Pair) -> None:
    """Two nodes here publish on one topic: ROS has each message once, from a node of the publisher's name."""
    topic = f"{pair.name}/several"
    subscription = await pair.there.subscription(topic, String)
    bare = pair.here.create_bare_node(f"{pair.name[1:]}_bare")
    publishers = [each.create_publisher(String, topic, 10) for each in (pair.here, bare)]
    for number, publisher in enumerate(publishers):
        await publisher.wait_for_subscriptions()
        await subscription.matched(2)
        publisher.publish(String(data=str(number)))
    found = await subscription.received(2)
    assert sorted(each.data for each in found) == ["0", "1"]
    names = [each[0] for each in await pair.there.endpoints(topic, "publishers", 2)]
    assert names == sorted([f"{pair.name}_here", f"{pair.name}_bare"])


async def test_nothing_comes_back(pair: Pair) -> None:
    """Both sides publish and subscribe on one topic: each node has each message once."""
    topic = f"{pair.name}/everywhere"
    received: list[str] = []
    there = await pair.there.publisher(topic, String)
    subscription = await pair.there.subscription(topic, String)
    here = pair.here.create_publisher(String, topic, 10)
    pair.here.create_subscription(String, topic, lambda each: received.append(each.data), 10)
    await there.matched(2)
    await subscription.matched(2)
    await here.wait_for_subscriptions(2)
    await there.publish(String(data="there"))
    await until(lambda: "there" in received)
    here.publish(String(data="here"))
    await subscription.received(2)
    # What follows all that could have come back: last messages in both directions.
    await there.publish(String(data="last of there"))
    await until(lambda: "last of there" in received)
    here.publish(String(data="last of here"))
    found = [each.data for each in await subscription.received(4)]
    assert sorted(received) == sorted(found) == ["here", "last of here", "last of there", "there"]
