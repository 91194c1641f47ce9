"""The broker's part in shared memory: references in, references or bytes out, and slots released in time."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import sys
from typing import TYPE_CHECKING, Any

import pytest

from broker import Broker, BrokerOptions
from broker.serving.shared_memory import LinkMemory, SharedMemory
from proto.aio.arena import Arena, ArenaError, host_identity
from proto.aio.session_proof import session_proof
from proto.errors import ErrorCode
from proto.queues.extents import PAGE_BYTES
from proto.wire import frames
from proto.wire.codes import Capability
from proto.wire.references import AHEAD_BYTES, SLOT_HEAD_BYTES, Slot
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link, until
from tests.seams.brokers import dispatcher_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

HOST = host_identity()
MESSAGE = b"m" * 100_000
NO_ARENA = frames.Arena(1, 1, 1, 4096, bytes(16))


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0)) as running:
        yield running


class Sender:
    """A publisher on `/t` with an arena.

    Attributes:
        client: Its link.
        arena: The arena.
        slots: What it has sent and not got back, by reference number.
        free: The free bytes of the arena while nothing is held.
    """

    def __init__(self, client: RawClient, size: int = 2**25) -> None:
        self.client = client
        self.arena = Arena(size)
        self.slots: dict[int, Slot] = {}
        self._publisher = self._sent = 0

    async def declare(self, qos: frames.Options | None = None) -> None:
        """Declare the publisher, and let the broker map the arena."""
        self.client.send(make.publisher(1, qos=qos), self.arena.announcement)
        self._publisher = (await self.client.next(frames.Accepted)).number
        assert await self.client.next(frames.Mapped) == frames.Mapped(self.arena.announcement.id, "")

    def reference(self, message: bytes = MESSAGE, **changes: Any) -> frames.Reference:
        """Put a message into the arena; return the reference to it, which is to be sent."""
        slot = self.arena.put(message)
        assert slot is not None
        number, self._sent = self._sent, self._sent + 1
        self.slots[number] = slot
        head = self._publisher, number, 1, 1, None, None
        return frames.Reference(
            *head, slot.arena.id, slot.offset, SLOT_HEAD_BYTES, len(message), slot.generation
        )._replace(**changes)

    async def release(self, *wanted: int) -> None:
        """Return when the broker has released these references."""
        released: set[int] = set()
        while not released >= set(wanted):
            for number in (await self.client.next(frames.Release)).numbers:
                del self.slots[number]
                released.add(number)
        assert released == set(wanted)


@contextlib.asynccontextmanager
async def sender(broker: Broker, qos: frames.Options | None = None) -> AsyncIterator[Sender]:
    """Have a publisher that has announced its arena."""
    async with link(broker, "/sender", host=HOST) as client:
        made = Sender(client)
        await made.declare(qos)
        yield made


@contextlib.asynccontextmanager
async def reader(broker: Broker, host: bytes | None = HOST, depth: int = 10) -> AsyncIterator[RawClient]:
    """Have a subscription on `/t`."""
    async with link(broker, "/reader", host=host) as client:
        client.send(make.subscription(1, qos={"depth": depth}))
        await client.next(frames.Accepted)
        yield client


async def open_arena(source: Sender, client: RawClient) -> int:
    """Let a reader open the sender's arena, for which one message is sent as bytes; return the arena's id."""
    source.client.send(source.reference())
    assert bytes((await client.next(frames.Batch)).payload) == b"\xdd\0\0\0\1" + MESSAGE
    announced = await client.next(frames.Arena)
    assert announced[1:] == source.arena.announcement[1:]
    await source.release(0)
    client.send(frames.Mapped(announced.id, ""))
    await client.synchronise()
    return announced.id


async def test_a_reader_on_the_host_gets_references_when_it_has_opened_the_arena(broker: Broker) -> None:
    """Before that it gets bytes; a slot is released when the reader has released it, and not before."""
    async with reader(broker) as client, sender(broker) as source:
        arena = await open_arena(source, client)
        reference = source.reference(attributes={"a": 1})
        source.client.send(reference)
        got = await client.next(frames.Reference)
        assert got == reference._replace(publisher=got.publisher, arena=arena)
        await source.client.synchronise()
        assert not source.client.waiting(frames.Release)
        client.send(frames.Release((0,)))
        await source.release(1)
        stats = broker.stats()
        assert (stats.copies, stats.delivered, stats.queued) == (2, 2, 0)
        assert (stats.shared_received, stats.shared_sent, stats.shared_copied) == (2, 1, 1)
        (topic,) = broker.topic_stats()
        assert (topic.messages, topic.bytes, topic.by_reference) == (2, 2 * len(MESSAGE), 2)
        received = sum(each.shared_bytes_received for each in broker.link_stats())
        sent = sum(each.shared_bytes_sent for each in broker.link_stats())
        assert (received, sent) == (2 * len(MESSAGE), len(MESSAGE))  # the first one went on as bytes


async def test_others_get_bytes_of_the_same_message(broker: Broker) -> None:
    """One link gets a reference, one without shared memory the bytes; both must be done with the slot."""
    async with reader(broker) as client, sender(broker) as source:
        await open_arena(source, client)
        async with link(broker, "/other") as other:
            other.send(make.subscription(1))
            await other.next(frames.Accepted)
            source.client.send(source.reference())
            assert bytes((await other.next(frames.Batch)).payload) == b"\xdd\0\0\0\1" + MESSAGE
            await client.next(frames.Reference)
            client.send(frames.Release((0,)))
            await source.release(1)


async def test_a_message_without_readers_is_released_at_once(broker: Broker) -> None:
    """Nothing holds it."""
    async with sender(broker) as source:
        source.client.send(source.reference(), source.reference())
        await source.release(0, 1)
        assert broker.stats().unmatched == 2


async def test_depth_holds_for_a_reader_that_releases_nothing(broker: Broker) -> None:
    """Only a limited number of bytes is on its way; of the others the newest are kept, and follow."""
    message = bytes(AHEAD_BYTES // 4)
    async with reader(broker, depth=1) as client, sender(broker) as source:
        await open_arena(source, client)
        source.client.send(*(source.reference(message) for _ in range(7)))
        await source.release(5, 6)
        for number in range(1, 5):
            assert (await client.next(frames.Reference)).first_sequence == number
        client.send(frames.Release((0,)))
        assert (await client.next(frames.Reference)).first_sequence == 7
        assert broker.stats().dropped == 2


async def test_the_end_of_a_reader_releases_what_it_read(broker: Broker) -> None:
    """Its slots come back when its link ends, however it ends."""
    async with sender(broker) as source:
        async with reader(broker) as client:
            await open_arena(source, client)
            source.client.send(source.reference(), source.reference())
            await client.next(frames.Reference)
        await source.release(1, 2)


async def test_a_reader_gets_what_a_publisher_sent_before_its_end(broker: Broker) -> None:
    """The broker keeps the memory; the reader forgets the arena when nothing of it is left."""
    async with reader(broker) as client:
        async with sender(broker) as source:
            arena = await open_arena(source, client)
            source.client.send(*(source.reference() for _ in range(3)))
            await source.client.synchronise()
        for number in (1, 2, 3):
            assert (await client.next(frames.Reference)).first_sequence == number
        assert not client.waiting(frames.Unmap)
        client.send(frames.Release((0, 2, 1)))
        assert await client.next(frames.Unmap) == frames.Unmap(arena)


async def test_an_arena_without_messages_is_forgotten_with_its_publisher(broker: Broker) -> None:
    """A reader that could not open it gets bytes, and forgets it, too."""
    async with reader(broker) as client:
        async with sender(broker) as source:
            source.client.send(source.reference())
            announced = await client.next(frames.Arena)
            client.send(frames.Mapped(announced.id, "no"))
            await client.synchronise()
            await source.release(0)
            source.client.send(source.reference())
            await client.next(frames.Batch)
        assert await client.next(frames.Unmap) == frames.Unmap(announced.id)


def test_nothing_is_a_proof_without_a_secret() -> None:
    """Before a client has asked for it, and when the broker has stopped: anybody guesses an empty one."""
    shared = SharedMemory(enabled=True, descriptors=1)
    proof = session_proof(b"", 1, b"")
    assert not shared.proves(proof, 1, b"")
    assert shared.offer(HOST)
    shared.close()
    assert not shared.proves(proof, 1, b"")


def link_memories() -> list[LinkMemory]:
    """Return those of all links with shared memory in this process."""
    gc.collect()
    return [each for each in gc.get_objects() if isinstance(each, LinkMemory)]


async def test_an_ended_reader_is_forgotten(broker: Broker) -> None:
    """Also while the arena that it has read stays open."""
    async with sender(broker) as source:
        before = link_memories()
        async with reader(broker) as client:
            await open_arena(source, client)
            assert len([each for each in link_memories() if each not in before]) == 1
        await until(lambda: broker.stats().connections == 1)
        assert all(each in before for each in link_memories())


async def test_latched_messages_are_not_referred_to(broker: Broker) -> None:
    """They would keep their slots, or cost the broker a copy at once."""
    async with sender(broker, make.LATCHED) as source:
        source.client.send(source.reference())
        assert (await source.client.next(frames.Error)).code == ErrorCode.UNEXPECTED
        assert not broker.stats().latched


@pytest.mark.parametrize("same", [True, False])
async def test_only_clients_of_the_host_learn_of_shared_memory(*, same: bool) -> None:
    """Others, and all clients of a broker without it, may not use its frames."""
    options = BrokerOptions(port=0, shared_memory=not same)
    async with Broker(options) as broker, RawClient().connected(broker) as client:
        client.send(hello(host=HOST if same else b"other" * 3 + b"!"))
        words = str((await client.next(frames.Welcome)).options["capabilities"]).split()
        assert Capability.SHARED_MEMORY not in words
        assert Capability.STRICT_QOS in words
        client.send(NO_ARENA)
        assert (await client.next(frames.Error)).code == ErrorCode.UNEXPECTED


async def test_an_arena_that_cannot_be_opened_has_an_answer(broker: Broker) -> None:
    """The client sends bytes then; a reference is an error."""
    async with link(broker, "/n", host=HOST) as client:
        client.send(NO_ARENA)
        answer = await client.next(frames.Mapped)
        assert answer.id == NO_ARENA.id
        assert answer.problem
        client.send(frames.Reference(1, 0, 0, 1, None, None, NO_ARENA.id, 0, SLOT_HEAD_BYTES, 4096, 1))
        assert (await client.next(frames.Error)).code == ErrorCode.UNKNOWN_ID


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"offset": 2**25}, ErrorCode.MALFORMED),
        ({"offset": 2**64 - 1}, ErrorCode.MALFORMED),
        ({"size": 0}, ErrorCode.MALFORMED),
        ({"size": 4095}, ErrorCode.MALFORMED),
        ({"size": 2**21}, ErrorCode.TOO_LARGE),
        ({"arena": 2**32 - 1}, ErrorCode.UNKNOWN_ID),
        ({"publisher": 999}, ErrorCode.UNKNOWN_ID),
        ({"first_sequence": 2**64 - 1}, ErrorCode.MALFORMED),
    ],
)
async def test_a_wrong_reference_ends_its_link(wrong: dict[str, Any], code: ErrorCode) -> None:
    """As a wrong BATCH would; nothing reaches a reader."""
    options = BrokerOptions(port=0, drain_timeout_sec=0.2, max_message_bytes=2**21)
    async with Broker(options) as broker, reader(broker) as client, sender(broker) as source:
        source.client.send(source.reference(**wrong))
        assert (await source.client.next(frames.Error)).code == code
        await source.client.gone()
        await client.synchronise()
        assert not client.waiting(frames.Batch)


async def test_an_arena_may_have_the_id_0(broker: Broker) -> None:
    """As any other; a second one is refused all the same."""
    async with link(broker, "/sender", host=HOST) as client, reader(broker) as other:
        source = Sender(client)
        source.arena.announcement = source.arena.announcement._replace(id=0)
        await source.declare()
        client.send(source.reference())
        await other.next(frames.Batch)
        client.send(source.arena.announcement)
        assert (await client.next(frames.Error)).code == ErrorCode.UNEXPECTED


async def test_an_answer_about_an_unknown_arena_is_ignored(broker: Broker) -> None:
    """It may have ended meanwhile; it is no failure, either."""
    async with reader(broker) as client:
        client.send(frames.Mapped(999, "cannot"))
        await client.synchronise()
        assert not broker.stats().refused_arenas


async def test_an_arena_that_ended_before_its_announcement_is_forgotten(broker: Broker) -> None:
    """Its messages arrive as bytes; nothing remains on the reader's link."""
    async with link(broker, "/reader", host=HOST) as client:
        client.send(make.subscription(1, qos=make.KEEP_ALL))
        await client.next(frames.Accepted)
        async with sender(broker) as source:
            source.client.send(source.reference(), frames.Goodbye("done"))
            await source.client.gone()
        await client.next(frames.Batch)
        await client.next(frames.Unmap)


@pytest.mark.parametrize("frame", [frames.Release((0,)), NO_ARENA], ids=["release", "second arena"])
async def test_frames_out_of_place_end_the_link(broker: Broker, frame: frames.Frame) -> None:
    """A release of what was not sent; another arena."""
    async with sender(broker) as source:
        source.client.send(frame)
        assert (await source.client.next(frames.Error)).code == ErrorCode.UNEXPECTED


async def test_a_broker_that_stops_waits_for_readers(broker: Broker) -> None:
    """What waits for a release is delivered before the broker says goodbye."""
    message = bytes(AHEAD_BYTES)
    async with reader(broker) as client, sender(broker) as source, asyncio.TaskGroup() as group:
        await open_arena(source, client)
        source.client.send(source.reference(message), source.reference(message))
        await client.next(frames.Reference)
        await source.client.synchronise()
        assert broker.stats().queued == 1
        stop = group.create_task(broker.stop())
        for each in (source.client, client, source.client, client):
            await each.synchronise()
        assert not stop.done()
        client.send(frames.Release((0,)))
        assert (await client.next(frames.Reference)).first_sequence == 2
        for each in (source.client, client):
            await each.next(frames.Goodbye)
            each.channel.close()


async def test_what_ended_links_have_shared_still_counts(broker: Broker) -> None:
    """Of a reader that got bytes once and a reference once."""
    async with reader(broker) as client, sender(broker) as source:
        await open_arena(source, client)
        source.client.send(source.reference())
        await client.next(frames.Reference)
    await until(lambda: not broker.stats().connections)
    stats = broker.stats()
    assert (stats.shared_received, stats.shared_sent, stats.shared_copied) == (2, 1, 1)


async def test_an_arena_that_ended_while_its_message_waited_is_not_announced(broker: Broker) -> None:
    """Nobody can open it any more: the message arrives as bytes, and the reader's link forgets the arena."""
    async with reader(broker, depth=100) as client:
        client.stop_reading()
        async with link(broker, "/other") as other:
            other.send(make.publisher(1))
            number = (await other.next(frames.Accepted)).number
            for first in range(40):  # more than sockets hold
                other.send(make.batch(number, first, size=200_000))
            await other.synchronise()
            async with sender(broker) as source:
                source.client.send(source.reference(), frames.Goodbye("done"))
                await source.client.gone()
            client.go_on_reading()
            while not isinstance(got := await client.next(object), frames.Unmap):
                assert not isinstance(got, frames.Arena)


def test_fewer_descriptors_mean_fewer_arenas() -> None:
    """Each that the broker has opened needs one."""
    shared = SharedMemory(enabled=True, descriptors=1)
    first, second = Arena(2 * PAGE_BYTES), Arena(2 * PAGE_BYTES)
    shared.open(first.announcement)
    with pytest.raises(ArenaError, match="too many arenas"):
        shared.open(second.announcement)


async def test_a_broker_that_holds_too_much_discards_references(
    broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As it discards other large messages; their slots are released."""
    async with reader(broker) as client, sender(broker) as source:
        await open_arena(source, client)
        reassembly = dispatcher_of(broker).reassembly
        monkeypatch.setattr(type(reassembly), "refusing", True)
        source.client.send(source.reference())
        await source.release(1)
        monkeypatch.undo()
        source.client.send(source.reference())
        assert (await client.next(frames.Reference)).first_sequence == 2
