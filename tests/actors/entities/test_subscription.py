"""Subscriptions without a broker: what it would send is handed to the link's feeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.std_msgs.msg import Int64
from proto.frames import Attached, Replay, Run
from proto.runs import RunBuilder

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterable
    from pathlib import Path

GID = bytes(16)


@pytest.fixture
async def node(tmp_path: Path) -> AsyncIterator[actors.Node]:
    """A running node that never finds a broker."""
    async with actors.Node("hearer", url=f"callboard+unix://{tmp_path}/none") as running:
        yield running


def run_of(publisher: int, numbers: range) -> Run:
    """Return a run whose messages are their own sequence numbers."""
    builder = RunBuilder(numbers.start)
    for number in numbers:
        codec_for(Int64).append(Int64(data=number), builder.buffer)
        builder.close_message()
    return builder.take(publisher, 1)


def replay_of(subscription: int, publisher: int, numbers: range) -> Replay:
    """Return the same as latched messages."""
    return Replay(subscription, *run_of(publisher, numbers)[:-1])


async def heard_of(subscription: actors.Subscription[Int64], numbers: Iterable[int]) -> list[int]:
    """Return what is heard next, as many messages as there are numbers."""
    messages = aiter(subscription)
    return [(await anext(messages)).data for _ in numbers]


async def test_latched_messages_after_a_reconnect_are_no_loss(node: actors.Node) -> None:
    """What a replay brings after all is not counted as lost; what it does not bring is."""
    subscription = node.create_subscription(Int64, "numbers", qos=10)
    feeds = node._core.link.feeds
    feeds.attached(Attached(1, (subscription.id,), GID, 0, "/talker"))
    feeds.run_received(run_of(1, range(3)))
    feeds.clear()
    feeds.attached(Attached(7, (subscription.id,), GID, 9, "/talker"))
    assert subscription.lost_on_break == 6
    feeds.replay_received(replay_of(subscription.id, 7, range(5, 7)))
    feeds.replay_received(replay_of(subscription.id, 7, range(7, 9)))
    feeds.run_received(run_of(7, range(9, 10)))
    assert subscription.lost_on_break == 2
    assert subscription.lost == 0
    assert await heard_of(subscription, range(8)) == [0, 1, 2, 5, 6, 7, 8, 9]


async def test_latched_messages_that_have_been_seen_are_discarded(node: actors.Node) -> None:
    """A publisher that gives its messages to a new broker again does not make them come twice."""
    subscription = node.create_subscription(Int64, "numbers", qos=10)
    feeds = node._core.link.feeds
    feeds.attached(Attached(1, (subscription.id,), GID, 0, "/talker"))
    feeds.run_received(run_of(1, range(3)))
    feeds.clear()
    feeds.attached(Attached(7, (subscription.id,), GID, 3, "/talker"))
    feeds.replay_received(replay_of(subscription.id, 7, range(3)))
    feeds.run_received(run_of(7, range(2, 5)))
    assert await heard_of(subscription, range(5)) == [0, 1, 2, 3, 4]
    assert subscription.queued == subscription.lost == subscription.lost_on_break == 0
