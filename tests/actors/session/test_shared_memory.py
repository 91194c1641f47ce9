"""Large messages between nodes on one host: in shared memory where that is possible, otherwise as bytes."""

from __future__ import annotations

import asyncio
import errno
import os
import sys
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest

import actors
import broker.serving.shared_memory
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from actors.session import shared_memory
from actors.session.shared_memory import SharedMemory
from actors.testing import FaultProxy
from broker import Broker, BrokerOptions
from proto.aio import arena
from proto.wire.frames import Reference
from proto.wire.references import AHEAD_BYTES, MIN_REFERENCE_BYTES
from tests.actors.meeting import BARE, KEEP_ALL, MIB, latched, until
from tests.seams.nodes import all_released, link_of, readers_of
from tests.seams.simulation import arena_of, released_slots

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.diagnostics.shared_memory import SharedMemoryDiagnostics
    from proto.wire.frames import Batch
    from tests.actors.meeting import Meeting

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds"),
    pytest.mark.usefixtures("patience"),
]

LARGE = 300_000


def numbered(number: int, size: int = LARGE) -> UInt8MultiArray:
    """Return a message whose content depends on its number everywhere."""
    return UInt8MultiArray(data=bytes([number]) * size)


def number_of(message: UInt8MultiArray) -> int:
    """Return the number of a message; fail if its content is not that of one message."""
    data = bytes(message.data)
    assert data == data[:1] * len(data)
    return data[0]


def shared(node: actors.Node) -> SharedMemoryDiagnostics:
    """Return a node's counts."""
    return node.diagnostics().shared_memory


class Pair:
    """A publisher and a subscription on different nodes.

    Attributes:
        talker, listener: The nodes.
        received: The numbers of complete messages, as they arrived.
    """

    def __init__(self, talker: actors.Node, listener: actors.Node, qos: Any = 10) -> None:
        self.talker, self.listener = talker, listener
        self.received: list[int] = []
        self.subscription = listener.create_subscription(UInt8MultiArray, "t", self._take, qos)
        self.publisher = talker.create_publisher(UInt8MultiArray, "t", qos)

    def _take(self, message: UInt8MultiArray) -> None:
        self.received.append(number_of(message))

    async def send(self, number: int, size: int = LARGE) -> None:
        """Publish a message and wait until it has arrived."""
        before = len(self.received)
        self.publisher.publish(numbered(number, size))
        await until(lambda: self.received[before:] == [number])

    async def opened(self) -> Pair:
        """Send messages until both ends have opened the arena, and forget them."""
        await self.publisher.wait_for_subscriptions()
        while not shared(self.listener).received:
            await self.send(255)
        await until(lambda: shared(self.talker).sent)
        self.received.clear()
        return self


async def pair(meeting: Meeting, qos: Any = 10, **options: Any) -> Pair:
    """Return a pair of nodes that exchange messages through shared memory."""
    talker, listener = await meeting.node("talker", **BARE, **options), await meeting.node("listener", **BARE)
    return await Pair(talker, listener, qos).opened()


async def test_large_messages_arrive_in_order_among_small_ones(meeting: Meeting) -> None:
    """Sizes on both sides of every limit; the large ones by reference."""
    both = await pair(meeting, KEEP_ALL)
    before = shared(both.talker).sent
    sizes = (1, 15_000, 16_500, 40_000, 50_000, 66_000, 300_000, 10, 5 * MIB, 262_000)
    for number, size in enumerate(sizes):
        both.publisher.publish(numbered(number, size))
    await until(lambda: len(both.received) == len(sizes))
    assert both.received == list(range(len(sizes)))
    assert shared(both.talker).sent - before == 7
    assert shared(both.listener).stale == shared(both.talker).full == 0


async def test_every_way_to_publish_uses_it(meeting: Meeting) -> None:
    """A message, encoded bytes, and what is encoded into the buffer of large messages."""
    both = await pair(meeting)
    before = shared(both.talker).written
    encoded = bytearray()
    raw = both.listener.create_subscription(UInt8MultiArray, "t", encoded.extend, 10, raw=True)
    await both.publisher.wait_for_subscriptions(2)
    await both.send(1)
    await until(lambda: encoded)
    both.publisher.publish(bytes(encoded))
    both.publisher.publish_encoded(memoryview(encoded))
    await until(lambda: both.received == [1, 1, 1])
    assert shared(both.talker).written - before == 3
    raw.destroy()


async def test_what_a_reader_holds_stays_as_it_is(meeting: Meeting) -> None:
    """A received message is read-only, and keeps its content while others use the memory again."""
    both = await pair(meeting)
    held: list[UInt8MultiArray] = []
    both.listener.create_subscription(UInt8MultiArray, "t", held.append, 10)
    await both.publisher.wait_for_subscriptions(2)
    for number in range(20):
        await both.send(number)
    assert [bytes(message.data) for message in held] == [bytes([number]) * LARGE for number in range(20)]
    with pytest.raises(TypeError):
        memoryview(held[0].data)[0] = 1


async def test_several_readers_share_a_slot(meeting: Meeting) -> None:
    """Nodes with shared memory and one without get every message."""
    both = await pair(meeting)
    others = [
        Pair(both.talker, await meeting.node(f"reader{number}", shared_memory=number > 0, **BARE))
        for number in range(3)
    ]
    await both.publisher.wait_for_subscriptions(4)
    for number in range(5):
        await both.send(number)
        await until(lambda: all(other.received == both.received for other in others))
    assert all(other.received == list(range(5)) for other in others)
    assert [shared(other.listener).received > 0 for other in others] == [False, True, True]


@pytest.mark.parametrize("where", ["node", "broker", "environment"])
async def test_it_can_be_turned_off(where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the publisher's node, the broker, or the environment."""
    if where == "environment":
        monkeypatch.setenv("CALLBOARD_SHARED_MEMORY", "0")
    async with (
        Broker(BrokerOptions(port=0, shared_memory=where != "broker")) as running,
        actors.Node("talker", url=running.url, shared_memory=where != "node") as talker,
        actors.Node("listener", url=running.url) as listener,
    ):
        both = Pair(talker, listener)
        await both.publisher.wait_for_subscriptions()
        for number in range(5):
            await both.send(number)
        assert not shared(talker).active
        assert (shared(talker).written, shared(listener).received) == (0, 0)


async def test_the_limit_is_an_option(meeting: Meeting) -> None:
    """A message below it goes as bytes."""
    both = await pair(meeting, shared_memory_min_bytes=LARGE)
    before = shared(both.talker).written
    await both.send(1, LARGE - 1000)
    assert shared(both.talker).written == before
    await both.send(2, LARGE)
    assert shared(both.talker).written == before + 1


async def test_the_limit_is_at_least_what_a_broker_takes(meeting: Meeting) -> None:
    """A reference to less would close the link."""
    both = await pair(meeting, shared_memory_min_bytes=1)
    before = shared(both.talker).written
    await both.send(1, MIN_REFERENCE_BYTES - 100)
    assert shared(both.talker).written == before
    await both.send(2, MIN_REFERENCE_BYTES)
    assert shared(both.talker).written == before + 1


async def test_a_node_that_cannot_read_the_secret_sends_bytes(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one of another user that has the broker's host identity."""

    def denied(process: int, number: int) -> bytes:
        raise arena.ArenaError(f"cannot open /proc/{process}/fd/{number}: Permission denied")

    monkeypatch.setattr(shared_memory, "read_token", denied)
    both = Pair(await meeting.node("talker", **BARE), await meeting.node("listener", **BARE))
    await both.publisher.wait_for_subscriptions()
    for number in range(3):
        await both.send(number)
    assert not shared(both.talker).active
    assert "Permission denied" in shared(both.talker).problem


async def test_through_a_proxy_messages_go_as_bytes(meeting: Meeting) -> None:
    """The broker cannot know that it is none of another user who repeats what nodes prove."""
    async with FaultProxy(meeting.broker.url) as proxy, actors.Node("talker", url=proxy.url) as talker:
        both = Pair(talker, await meeting.node("listener", **BARE))
        await both.publisher.wait_for_subscriptions()
        for number in range(3):
            await both.send(number)
        await until(lambda: "not proved" in shared(talker).problem)
        assert shared(talker).sent == 0


def _no_memory(*_: object) -> int:
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("where", "function", "problem"),
    [("memfd_create", _no_memory, "No space"), ("posix_fallocate", _no_memory, "No space")],
)
async def test_without_memory_messages_go_as_bytes(
    meeting: Meeting,
    monkeypatch: pytest.MonkeyPatch,
    where: str,
    function: Callable[..., int],
    problem: str,
) -> None:
    """A system without space for an arena, and one that cannot provide more of it."""
    both = Pair(await meeting.node("talker", **BARE), await meeting.node("listener", **BARE))
    await both.publisher.wait_for_subscriptions()
    monkeypatch.setattr(os, where, function)
    for number in range(3):
        await both.send(number)
    assert (shared(both.talker).sent, shared(both.listener).received) == (0, 0)
    assert problem in shared(both.talker).problem


def _not_opened(*_: object) -> memoryview:
    raise arena.ArenaError("No space left on device")


async def test_an_arena_that_the_broker_cannot_open_is_not_used(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The publisher learns why, logs it once, and writes nothing there any more."""
    monkeypatch.setattr(broker.serving.shared_memory, "open_arena", _not_opened)
    both = Pair(await meeting.node("talker", **BARE), await meeting.node("listener", **BARE))
    await both.publisher.wait_for_subscriptions()
    for number in range(5):
        await both.send(number)
    await until(lambda: "No space" in shared(both.talker).problem)
    assert caplog.text.count("large messages") == 1
    before = shared(both.talker).written
    await both.send(9)
    assert shared(both.talker).written == before
    assert meeting.broker.stats().refused_arenas == 1


@pytest.mark.parametrize("size", [20_000, LARGE])
async def test_a_full_arena_sends_bytes(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, size: int
) -> None:
    """More than fits in one loop turn: the rest goes as bytes, in order, and this is logged once."""
    monkeypatch.setattr(shared_memory, "ARENA_BYTES", MIB)
    both = await pair(meeting, KEEP_ALL)
    for number in range(100):
        both.publisher.publish(numbered(number, size))
    await until(lambda: len(both.received) == 100)
    assert both.received == list(range(100))
    assert shared(both.talker).full > 1
    assert caplog.text.count("its 1 MiB have no space") == 1


async def test_a_reader_in_the_same_process_that_keeps_messages_gets_bytes(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it keeps fills the memory; it stays as it was, and the publisher goes on."""
    monkeypatch.setattr(shared_memory, "ARENA_BYTES", MIB)
    both = await pair(meeting)
    kept: list[UInt8MultiArray] = []
    both.listener.create_subscription(UInt8MultiArray, "t", kept.append, 10)
    await both.publisher.wait_for_subscriptions(2)
    for number in range(10):
        await both.send(number)
    await until(lambda: len(kept) == 10)
    assert shared(both.talker).full >= 7
    assert [bytes(message.data) for message in kept] == [bytes([number]) * LARGE for number in range(10)]
    before = shared(both.talker).written
    kept.clear()
    while shared(both.talker).written == before:  # until the broker has released them, too
        await both.send(10)
        kept.clear()


async def test_a_reader_changes_nothing_for_others(meeting: Meeting) -> None:
    """Neither for the publisher nor for another reader in the same process, in either direction."""
    both = await pair(meeting)
    other = Pair(both.talker, await meeting.node("other", **BARE))
    got: list[UInt8MultiArray] = []

    def change(message: UInt8MultiArray) -> None:
        with pytest.raises(TypeError):
            memoryview(message.data)[0] = 1
        message.data = bytes(LARGE)
        got.append(message)

    both.listener.create_subscription(UInt8MultiArray, "t", change, 10)
    await both.publisher.wait_for_subscriptions(3)
    source = bytearray(b"\x07" * LARGE)
    message = UInt8MultiArray(data=memoryview(source))
    both.publisher.publish(message)
    source[:] = bytes(LARGE)
    await until(lambda: both.received == other.received == [7] and len(got) == 1)
    assert bytes(message.data) == bytes(LARGE)


@pytest.mark.parametrize(("qos", "most"), [(KEEP_ALL, 4), (2, 15)])
async def test_messages_of_one_loop_turn_share_a_batch(meeting: Meeting, qos: Any, most: int) -> None:
    """Each frame has many of them, at most as many as the publisher's depth allows to wait, and one more."""
    both = await pair(meeting, KEEP_ALL)
    both.publisher.destroy()
    both.publisher = both.talker.create_publisher(UInt8MultiArray, "t", qos)
    await both.publisher.wait_for_subscriptions()
    await both.send(255)  # with the credit of the reader, without which KEEP_LAST drops
    both.received.clear()
    lengths: list[int] = []
    receive = SharedMemory.receive

    def count(memory: SharedMemory, frame: Reference) -> Batch | None:
        lengths.append(frame.length)
        return receive(memory, frame)

    with mock.patch.object(SharedMemory, "receive", count):
        for number in range(30):
            both.publisher.publish(numbered(number, 70_000))
        await until(lambda: len(both.received) == 30)
    assert both.received == list(range(30))
    assert sum(lengths) == 30
    assert len(lengths) <= most


async def test_it_begins_anew_with_another_broker(meeting: Meeting) -> None:
    """After a restart a new arena is made, since readers may still read the old one; numbers begin at 0."""
    both = await pair(meeting, KEEP_ALL)
    writes, reads = (link_of(node).shared_memory for node in (both.talker, both.listener))
    first = arena_of(writes)
    assert first is not None
    await meeting.broker.stop()
    await until(lambda: not both.talker.connected and not both.listener.connected)
    assert not shared(both.talker).active
    assert not readers_of(reads)
    await meeting.restart_broker()
    await both.publisher.wait_for_subscriptions()
    await until(both.subscription.get_publisher_count)
    before = shared(both.listener).received
    while shared(both.listener).received == before:
        await both.send(2)
    second = arena_of(writes)
    assert second is not None
    assert second.announcement.token != first.announcement.token
    await until(lambda: all_released(writes))
    await both.listener.get_graph()  # the broker has taken what was released
    assert link_of(both.listener).connections == 2


def test_messages_whose_slot_was_used_again_are_counted() -> None:
    """They are released like others."""
    memory = SharedMemory()
    readers_of(memory)[1] = lambda _: None
    assert memory.receive(Reference(1, 0, 0, 3, None, None, 1, 0, 64, 5000, 1)) is None
    assert (memory.received, memory.stale, released_slots(memory)) == (3, 3, [0])


async def test_latched_messages_reach_late_joiners(meeting: Meeting) -> None:
    """They go as bytes, since they are kept."""
    talker = await meeting.node("talker", **BARE)
    publisher = talker.create_publisher(UInt8MultiArray, "t", latched(1))
    publisher.publish(numbered(7))
    await publisher.flush()
    late = Pair(talker, await meeting.node("late", **BARE), latched(1))
    await until(lambda: late.received == [7])
    assert shared(talker).written == 0


async def test_all_slots_come_back(meeting: Meeting) -> None:
    """After thousands of slots with drops and readers that come and go, all of the arena is free."""
    both = await pair(meeting, 1)
    for number in range(60):
        other = (
            Pair(both.talker, await meeting.node(f"other{number}", **BARE), 1) if not number % 20 else None
        )
        for _ in range(10):
            both.publisher.publish(numbered(number))
        await until(lambda: both.received[-1:] == [number])  # noqa: B023 - called in this round
        if other is not None:
            other.subscription.destroy()
            other.publisher.destroy()
    for number in range(6):  # 48 of 64 MiB: more than would be free if many slots had been lost
        both.publisher.publish(numbered(number, 8 * MIB))
    await until(lambda: both.received[-1:] == [5])
    await asyncio.sleep(0)
    assert shared(both.talker).full == 0


async def test_late_joiners_get_large_latched_messages_of_a_link_with_shared_memory(
    meeting: Meeting,
) -> None:
    """They go as bytes, in order with each other, while other messages of the link go by reference."""
    both = await pair(meeting)
    kept = both.talker.create_publisher(UInt8MultiArray, "kept", latched(3))
    before = shared(both.talker).sent
    for number in range(5):
        kept.publish(numbered(number))
        await both.send(number)
    await kept.flush()
    assert shared(both.talker).sent == before + 5
    late: list[int] = []
    both.listener.create_subscription(
        UInt8MultiArray, "kept", lambda message: late.append(number_of(message)), latched(3)
    )
    await until(lambda: late == [2, 3, 4])
    kept.publish(numbered(5))
    await until(lambda: late == [2, 3, 4, 5])


async def test_a_keep_all_reader_gets_all_of_a_keep_last_publisher_beyond_what_is_referred_to(
    meeting: Meeting,
) -> None:
    """Twice as much as the broker refers to before a release: what waits for it is neither lost nor bytes."""
    count = 2 * AHEAD_BYTES // MIB
    both = await pair(meeting, actors.QoSProfile(depth=count))
    got: list[int] = []
    reader = await meeting.node("keeper", **BARE)
    reader.create_subscription(UInt8MultiArray, "t", lambda message: got.append(number_of(message)), KEEP_ALL)
    await both.publisher.wait_for_subscriptions(2)
    both.subscription.destroy()
    while not shared(reader).received:
        both.publisher.publish(numbered(200))
        await until(lambda: got and got.pop() == 200)
    before, copied = shared(reader).received, meeting.broker.stats().shared_copied
    for number in range(count):
        both.publisher.publish(numbered(number, MIB))
    await until(lambda: len(got) == count)
    assert got == list(range(count))
    assert shared(reader).received - before == count
    assert meeting.broker.stats().shared_copied == copied
