"""How topics of ROS 2 are received, with a stand-in for ROS 2."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import pytest

from actors.bridges.counters import Counts
from actors.bridges.plan import Mirror
from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.message_taker import RosMessageInfo
from actors.bridges.ros2.participant import Participant
from actors.bridges.ros2.patient_publisher import LINGER_SEC
from actors.bridges.ros2.topics import TopicFromRos
from actors.interfaces.std_msgs.msg import String
from actors.qos.profile import QoSProfile
from tests.actors.bridges.ros2_stand_in import OTHER, Network, make_ros
from tests.actors.bridges.sides import PUBLISHER, STRING, SUBSCRIPTION
from tests.actors.meeting import until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

DEPTH = QoSProfile(depth=100)


class Publisher:
    """A mirror in callboard."""

    def __init__(self) -> None:
        self.refusal = ""
        self.published: list[tuple[bytes, int]] = []

    def publish_encoded(self, data: bytes, stamp_ns: int) -> None:
        """Note a message."""
        assert 0 <= stamp_ns < 2**63
        self.published.append((data, stamp_ns))

    def destroy(self) -> None:
        """End."""


class Received:
    """One topic with a publisher in ROS 2, and what receives it."""

    def __init__(self) -> None:
        self.network = Network()
        ros = make_ros(self.network)
        self.errors: list[Exception] = []
        arrivals = Arrivals(ros, asyncio.get_running_loop(), self.errors.append)
        self.participant = Participant(ros, bridge_id="one", arrivals=arrivals)
        self.counts = Counts()
        self.publisher = Publisher()
        types: Any = SimpleNamespace(ours=String, theirs=STRING)
        observer = Mock(node_of=Mock(return_value="/talker"))
        self.topic = TopicFromRos(
            "/text", types, observer, self.participant.control, self.counts, convert=bytes
        )
        bare = Mock(create_publisher=Mock(return_value=self.publisher))
        self.topic.add_publisher(
            Mirror("/talker", PUBLISHER, "/text", STRING, DEPTH, "/text", "/talker"), bare
        )

    def subscribe(self, name: str) -> Mirror:
        """Show a subscription of callboard."""
        mirror = Mirror(name, SUBSCRIPTION, "/text", STRING, DEPTH, "/text", name)
        self.topic.add_subscription(mirror, self.participant.mirror_node(name))
        return mirror

    @property
    def depths(self) -> dict[str, int]:
        """The depths of the subscriptions, by their nodes."""
        shown = [each for each in self.network.endpoints if each.kind is SUBSCRIPTION]
        return {each.node: each.qos.depth for each in shown}

    async def arrive(self, number: int, source_ns: int = 5) -> None:
        """Let a message arrive at all subscriptions that are listened to."""
        for pointer in tuple(self.network.eventfds):
            self.network.arrive(pointer, (b"text", RosMessageInfo(OTHER + bytes(4), number, source_ns, 7)))
        for _ in range(3):
            await asyncio.sleep(0)
        assert not self.errors


@pytest.fixture
async def received() -> AsyncIterator[Received]:
    """A topic, which ends with the test."""
    made = Received()
    yield made
    made.topic.close()
    made.participant.close()


async def test_what_is_only_shown_keeps_one_message(received: Received) -> None:
    """Nobody takes from it, so that it would keep its depth of the newest messages for ever."""
    first = received.subscribe("/first")
    received.subscribe("/second")
    received.topic.set_intake((DEPTH,))
    assert received.depths == {"/first": 100, "/second": 1}
    assert received.topic.remove(first) == LINGER_SEC
    received.topic.set_intake((DEPTH,))
    await until(lambda: received.depths == {"/second": 100})
    await received.arrive(1)
    assert received.publisher.published == [(b"text", 5)]


async def test_what_arrives_at_a_mirror_that_has_gone_crosses(received: Received) -> None:
    """Its node has got another name, say, and DDS has not connected its successor yet; once, and in order."""
    first = received.subscribe("/talker")
    received.topic.remove(first)
    await received.arrive(1)
    received.subscribe("/talker_callboard")
    received.topic.set_intake((DEPTH,))
    await received.arrive(2)
    await received.arrive(3)
    assert (received.counts.sent, received.counts.repeated, received.counts.lost) == (3, 2, 0)


async def test_a_mirror_that_only_was_seen_goes_at_once(received: Received) -> None:
    """It has nothing to take."""
    received.subscribe("/first")
    second = received.subscribe("/second")
    assert received.topic.remove(second) == 0
    assert received.depths == {"/first": 100}


async def test_what_is_lost_while_a_subscription_is_made_again_is_counted(received: Received) -> None:
    """By the gap in the numbers; what is published while nobody wants it is not lost."""
    received.topic.set_intake((DEPTH,))
    await received.arrive(1)
    received.topic.set_intake((QoSProfile(depth=10),))
    await received.arrive(4)
    assert received.counts.lost == 2
    received.topic.set_intake(())
    received.topic.set_intake((DEPTH,))
    await received.arrive(9)
    assert (received.counts.lost, received.counts.sent) == (2, 3)


async def test_what_the_broker_refuses_is_not_counted_as_sent(received: Received) -> None:
    """A publisher that may not publish drops its messages without a word."""
    received.topic.set_intake((DEPTH,))
    received.publisher.refusal = "no right to publish /text"
    await received.arrive(1)
    assert received.counts.sent == 0
    assert received.counts.examples == {"refused": "no right to publish /text"}


async def test_a_message_without_a_time_has_that_of_its_arrival(received: Received) -> None:
    """Programs of DDS that are not ROS 2's may write none, which is negative."""
    received.topic.set_intake((DEPTH,))
    await received.arrive(1, source_ns=-1)
    assert received.publisher.published == [(b"text", 7)]
