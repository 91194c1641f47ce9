"""Mirrors follow the QoS of the other side, also when it is mixed or changes."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.std_msgs.msg import String
from actors.qos.profile import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from actors.time.types import Duration
from proto.wire.codes import EntryKind
from tests.ros2.graphs import endpoints_until, graph_until
from tests.ros2.ros import WAIT_SEC
from tests.waiting import until

if TYPE_CHECKING:
    from actors.graph.snapshot import GraphSnapshot
    from tests.ros2.conftest import Pair

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PASSING = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan=Duration(seconds=10_000))
"""Latched, but not for ever."""
AGAIN_SEC = 0.05
"""After which a message is published again that best effort may have lost."""
TIMED = QoSProfile(
    depth=10,
    deadline=Duration(seconds=1),
    lifespan=Duration(seconds=2_000),
    liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
    liveliness_lease_duration=Duration(seconds=3),
)
TIMES = ["MANUAL_BY_TOPIC", 1_000_000_000, 2_000_000_000_000, 3_000_000_000]
"""Its liveliness, deadline, lifespan and lease."""
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


async def test_latched_values_of_ros_arrive_once(pair: Pair) -> None:
    """The first subscription here gets the value that was published before, and later ones get it, too."""
    topic = f"{pair.name}/latched"
    publisher = await pair.there.publisher(topic, String, LATCHED)
    await publisher.publish(String(data="old"), String(data="value"))
    first: list[str] = []
    second: list[str] = []
    pair.here.create_subscription(String, topic, lambda each: first.append(each.data), LATCHED)
    await until(lambda: first)
    pair.here.create_subscription(String, topic, lambda each: second.append(each.data), LATCHED)
    await until(lambda: second)
    await publisher.publish(String(data="next"))
    await until(lambda: first[-1:] == second[-1:] == ["next"])
    assert first == second == ["value", "next"]


async def test_latched_values_of_callboard_arrive_once(pair: Pair) -> None:
    """The first subscription of ROS gets the value that was published before, and later ones get it, too."""
    topic = f"{pair.name}/latched_here"
    publisher = pair.here.create_publisher(String, topic, LATCHED)
    publisher.publish(String(data="old"))
    publisher.publish(String(data="value"))
    first = await pair.there.subscription(topic, String, LATCHED)
    assert await first.received(1) == [String(data="value")]
    second = await pair.there.subscription(topic, String, LATCHED)
    assert await second.received(1) == [String(data="value")]
    publisher.publish(String(data="next"))
    for each in (first, second):
        assert await each.received(2) == [String(data="value"), String(data="next")]


@pytest.mark.parametrize("has_same_node", [False, True])
async def test_a_latched_value_arrives_after_a_volatile_publisher(has_same_node: bool, pair: Pair) -> None:
    """A latched publisher of ROS, of the same node or another, joins a volatile one: each message, once."""
    topic = f"{pair.name}/changing"
    received: list[str] = []
    volatile = await pair.there.publisher(topic, String)
    pair.here.create_subscription(String, topic, lambda each: received.append(each.data), LATCHED)
    await volatile.matched()
    await volatile.publish(String(data="volatile"))
    await until(lambda: received == ["volatile"])
    node = pair.there if has_same_node else await pair.ros.node(f"{pair.name[1:]}_other")
    latched = await node.publisher(topic, String, LATCHED)
    await latched.publish(String(data="latched"))
    await until(lambda: "latched" in received)
    await latched.publish(String(data="next"))
    await until(lambda: "next" in received)
    assert received == ["volatile", "latched", "next"]


async def test_a_mirror_that_is_made_again_keeps_latched_values_of_ros(pair: Pair) -> None:
    """A second publisher of the node changes what its mirror offers: who joins then gets the value, too."""
    topic = f"{pair.name}/again"
    publisher = await pair.there.publisher(topic, String, PASSING)
    await publisher.publish(String(data="value"))
    first: list[str] = []
    late: list[str] = []
    pair.here.create_subscription(String, topic, lambda each: first.append(each.data), LATCHED)
    await until(lambda: first == ["value"])
    await pair.there.publisher(topic, String, LATCHED)
    # The mirror that is there now is another publisher: whoever has read the old one reads its value again.
    await until(lambda: first == ["value", "value"])
    pair.here.create_subscription(String, topic, lambda each: late.append(each.data), LATCHED)
    await until(lambda: late == ["value"])
    await publisher.publish(String(data="next"))
    await until(lambda: first == ["value", "value", "next"] and late == ["value", "next"])


async def test_a_mirror_that_is_made_again_keeps_latched_values_of_callboard(pair: Pair) -> None:
    """A second publisher of the node changes what its mirror offers: who joins then gets the value, too."""
    topic = f"{pair.name}/again_here"
    publisher = pair.here.create_publisher(String, topic, PASSING)
    publisher.publish(String(data="value"))
    first = await pair.there.subscription(topic, String, LATCHED)
    await first.received(1)
    pair.here.create_publisher(String, topic, LATCHED)
    assert await first.received(2) == [String(data="value")] * 2
    await pair.there.endpoints(topic, "publishers", 1)  # the old mirror stays until what it sent has arrived
    late = await pair.there.subscription(topic, String, LATCHED)
    assert await late.received(1) == [String(data="value")]
    publisher.publish(String(data="next"))
    assert (await late.received(2))[1:] == [String(data="next")]
    assert (await first.received(3))[2:] == [String(data="next")]


async def test_reliable_and_best_effort_publishers_of_ros_share_a_topic(pair: Pair) -> None:
    """A subscription here gets the messages of both."""
    topic = f"{pair.name}/mixed"
    received: list[str] = []
    reliable = await pair.there.publisher(topic, String)
    best_effort = await pair.there.publisher(topic, String, BEST_EFFORT)
    pair.here.create_subscription(String, topic, lambda each: received.append(each.data), BEST_EFFORT)
    for text, each in (("reliable", reliable), ("best effort", best_effort)):
        await each.matched()
        while text not in received:  # best effort may lose some
            await each.publish(String(data=text))
            await asyncio.sleep(AGAIN_SEC)
    shown = await endpoints_until(pair.here, "publishers", topic, 1)
    assert shown[0].qos_profile.reliability in {ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT}


async def test_a_mirror_here_promises_what_its_original_in_ros_does(pair: Pair) -> None:
    """Deadline, lifespan, liveliness and lease, for events here, also of a publisher that is made again."""
    topic = f"{pair.name}/timed"
    plain = await pair.there.publisher(topic, String)
    [shown] = await endpoints_until(pair.here, "publishers", topic, 1)
    assert not shown.qos_profile.deadline.nanoseconds
    await plain.destroy()
    publisher = await pair.there.publisher(topic, String, TIMED)
    await graph_until(pair.here, lambda graph: _times_of(graph, topic) == [TIMES])
    received: list[str] = []
    missed: list[object] = []
    pair.here.create_subscription(
        String, topic, lambda each: received.append(each.data), TIMED,
        event_callbacks=actors.SubscriptionEventCallbacks(deadline=missed.append),
    )  # fmt: skip
    await publisher.matched()
    await publisher.publish(String(data="last"))
    await until(lambda: received and missed)


async def test_a_mirror_in_ros_promises_what_its_original_here_does(pair: Pair) -> None:
    """Deadline, lifespan, liveliness and lease, also of a publisher that is made again."""
    topic = f"{pair.name}/timed_here"
    await pair.there.subscription(topic, String)
    plain = pair.here.create_publisher(String, topic, 10)
    await pair.there.endpoints(topic, "publishers", 1)
    plain.destroy()
    pair.here.create_publisher(String, topic, TIMED)
    async with asyncio.timeout(WAIT_SEC):
        while await pair.there.ask("offered_times", topic) != [TIMES]:
            await asyncio.sleep(AGAIN_SEC)


def _times_of(snapshot: GraphSnapshot, topic: str) -> list[list[object]]:
    """Return the liveliness, deadline, lifespan and lease of a topic's publishers."""
    found = [each.qos_profile for each in snapshot.endpoints(EntryKind.PUBLISHER, topic)]
    return [
        [
            qos.liveliness.name,
            *(each.nanoseconds for each in (qos.deadline, qos.lifespan, qos.liveliness_lease_duration)),
        ]
        for qos in found
    ]


async def test_best_effort_of_callboard_is_shown_in_ros(pair: Pair) -> None:
    """A mirror offers what its original does, and a subscription of ROS that wants no more gets messages."""
    topic = f"{pair.name}/best_effort"
    publisher = pair.here.create_publisher(String, topic, BEST_EFFORT)
    subscription = await pair.there.subscription(topic, String, BEST_EFFORT)
    await publisher.wait_for_subscriptions()
    await subscription.matched()
    [shown] = await pair.there.endpoints(topic, "publishers", 1)
    assert shown[3] == "BEST_EFFORT"
    while not await subscription.count(AGAIN_SEC):
        publisher.publish(String(data="text"))


async def test_a_best_effort_subscription_of_ros_does_not_slow_a_reliable_one(pair: Pair) -> None:
    """Both get what callboard publishes."""
    topic = f"{pair.name}/both"
    publisher = pair.here.create_publisher(String, topic, 10)
    found = [await pair.there.subscription(topic, String, qos) for qos in (QoSProfile(depth=10), BEST_EFFORT)]
    await publisher.wait_for_subscriptions()
    for each in found:
        await each.matched()
    for each in found:
        while not await each.count(AGAIN_SEC):
            publisher.publish(String(data="text"))
