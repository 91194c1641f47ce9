"""Memory of what waits, is latched or received: counted, limited, and freed with the connection."""

from __future__ import annotations

import asyncio
import gc
import logging
import tracemalloc
import weakref
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, cast

import pytest

from broker import Broker, BrokerOptions
from broker.routing.departed_queues import FORGET_QUEUES
from broker.routing.router_limits import MAX_DEPARTED_QUEUES
from broker.serving.memory_guard import MemoryGuard
from broker.serving.stats import collect
from proto import limits
from proto.aio.arena import Arena, host_identity
from proto.aio.tls import client_context
from proto.errors import ErrorCode
from proto.queues.batches import with_raw
from proto.queues.outbox import REPLAY_AHEAD_BYTES, Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire import frames
from proto.wire.codec import Decoder, encode
from proto.wire.codes import Status
from proto.wire.fragments import ByteTotal, Reassembler, ReassemblyTotal
from proto.wire.receiver import SCRATCH_BYTES, Receiver
from proto.wire.session import Role, Session
from proto.wire.url import parse_url
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link, read_frame, until
from tests.broker.switch import Switch
from tests.certificates import Authority
from tests.seams.brokers import dispatcher_of
from tests.seams.protocol import handler_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

KIB = 1024
MANY: frames.Options = {**make.LATCHED, "depth": 100}


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


async def latch(broker: Broker, talker: RawClient, number: int, count: int, size: int) -> None:
    """Publish large latched messages; several at once could overtake each other."""
    for first in range(count):
        latched = broker.stats().latched
        talker.send(make.batch(number, first, 1, size=size))
        while broker.stats().latched == latched:
            await talker.synchronise()


async def test_a_late_joiner_gets_large_latched_messages_page_by_page() -> None:
    """Case 53: however much is latched, a reader gets all of it, in order, and little waits for it."""
    size, count = 3 * KIB * KIB, 6
    options = BrokerOptions(
        port=0, max_queue_bytes=KIB * KIB, max_bulk_bytes=KIB * KIB, drain_timeout_sec=0.2
    )
    async with Broker(options) as broker, link(broker, "/talker") as talker, link(broker, "/late") as late:
        numbers = []
        for index in range(2):
            talker.send(make.publisher(index + 1, f"/t{index}", qos=MANY))
            numbers.append((await talker.next(frames.Accepted)).number)
            await latch(broker, talker, numbers[index], count, size)
        late.stop_reading()
        late.send(*(make.subscription(index + 1, f"/t{index}", qos=MANY) for index in range(2)))
        late.send(*(make.subscription(index + 3, f"/t{index}", qos=MANY) for index in range(2)))
        await until(lambda: broker.stats().endpoints == 8)
        for number in numbers:
            talker.send(make.batch(number, count, 1))
        await talker.synchronise()
        assert broker.stats().ordered_bytes <= REPLAY_AHEAD_BYTES + 4 * (size + KIB)
        late.go_on_reading()
        got: dict[int, list[int]] = {subscription: [] for subscription in range(1, 5)}
        for _ in range(4 * count):
            replay = await late.next(frames.Replay)
            got[replay.subscription].append(replay.first_sequence)
        assert all(heard == list(range(count)) for heard in got.values())
        await late.synchronise()
        assert broker.stats().connections == 2


async def test_latched_messages_that_are_replaced_meanwhile_are_skipped() -> None:
    """Case 53: a reader that does not read keeps no latched messages in memory that are not kept any more."""
    size = 2 * KIB * KIB
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)))
        talker = await stack.enter_async_context(link(broker, "/talker"))
        late = await stack.enter_async_context(link(broker, "/late"))
        talker.send(make.publisher(1, qos={**make.LATCHED, "depth": 3}))
        number = (await talker.next(frames.Accepted)).number
        await latch(broker, talker, number, 3, size)
        late.stop_reading()
        late.send(*(make.subscription(index, qos=MANY) for index in range(1, 21)))
        await until(lambda: broker.stats().endpoints == 23)
        talker.send(*(make.batch(number, first, 1) for first in range(3, 6)))
        await talker.synchronise()
        # Only the messages that are partly sent are still in memory.
        assert broker.stats().ordered_bytes <= limits.MAX_TRANSFERS * (size + KIB)
        late.go_on_reading()
        live = [(await late.next(frames.Batch)).first_sequence for _ in range(3)]
        assert live == [3, 4, 5]


@pytest.mark.parametrize("host", [None, host_identity()], ids=["bytes", "shared memory"])
async def test_an_ended_connection_is_freed_without_the_garbage_collector(
    broker: Broker, host: bytes | None, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 48: nothing that a connection held stays in a circle of references, however it ends."""
    caplog.set_level(logging.CRITICAL, "callboard.broker")  # records keep their arguments
    async with link(broker, "/partner") as partner:
        partner.send(make.subscription(1), make.service(2), make.client(3, "/own"), make.publisher(4))
        await partner.synchronise()
        gc.collect()
        gc.disable()
        try:
            for ending in (frames.Goodbye("done"), frames.Ping(2**64 - 1), frames.Accepted(1, 1)):
                held = await _use_and_end(broker, partner, host, ending)
                await until(lambda: broker.stats().connections == 1)
                await partner.synchronise()
                assert [kind for kind, reference in held.items() if reference() is not None] == []
        finally:
            gc.enable()


async def _use_and_end(
    broker: Broker, partner: RawClient, host: bytes | None, ending: frames.Frame
) -> dict[str, weakref.ref[Any]]:
    """Use a link in every way, and end it; return references to what the broker held for it."""
    async with link(broker, "/guilty", host=host) as guilty:
        arena = None if host is None else Arena(2**20)
        if arena is not None:
            guilty.send(arena.announcement)
            await guilty.next(frames.Mapped)
        guilty.stop_reading()
        declared: list[frames.Frame] = [
            make.publisher(1, qos=make.LATCHED),
            make.subscription(2),
            make.client(3),
        ]
        guilty.send(*declared, make.service(4, "/own"), make.request(3, 1), frames.Watch(1, True))
        guilty.send(frames.Fragment(1, 10**6, True, bytes(100_000)))
        await until(lambda: broker.stats().pending_calls == 1)  # and it serves /own now
        partner.send(make.request(3, 1))
        await partner.synchronise()
        await until(lambda: broker.stats().pending_calls == 2)
        last = list(dispatcher_of(broker).links)[-1]
        channel = last.channel
        held: dict[str, Any] = {"link": last, "connection": handler_of(channel)}
        if isinstance(ending, frames.Ping):
            guilty.channel.abort()
        else:
            guilty.go_on_reading()
            guilty.send(ending)
            await guilty.gone() if isinstance(ending, frames.Accepted) else guilty.channel.close()
        return {kind: weakref.ref(each) for kind, each in held.items()}


@pytest.mark.parametrize("kind", ["batch", "request"])
async def test_attributes_have_a_limit(broker: Broker, kind: str) -> None:
    """Case 46: attributes of more than 4 KiB end the link; those within the limit are forwarded."""
    async with link(broker, "/guilty") as guilty:
        guilty.send(make.publisher(1), make.client(2), make.service(3))
        number = (await guilty.next(frames.Accepted)).number

        def carrying(size: int) -> frames.Frame:
            attributes = {f"key{index}": bytes(1000) for index in range(size // KIB)}
            if kind == "batch":
                return with_raw(make.batch(number, 0)._replace(attributes=attributes))
            return frames.Request(2, (frames.RequestEntry(1, None, attributes, b"q"),))

        guilty.send(carrying(4 * KIB))
        await guilty.synchronise()
        guilty.send(carrying(5 * KIB))
        error = await guilty.next(frames.Error)
        assert error.code == ErrorCode.MALFORMED
        assert "attributes?" in error.text or "requests" in error.text
        await until(lambda: broker.stats().connections == 0)


@pytest.mark.parametrize(
    ("length", "attributes"),
    [(1, None), (100, None), (1, {"a": b"x" * 3900}), (1, {f"k{index}": "x" * 50 for index in range(60)})],
)
def test_waiting_batches_count_what_they_hold(length: int, attributes: frames.Options | None) -> None:
    """Case 46: what a limit counts for tiny batches, many messages and attributes is their memory."""
    outbox, queue, decoder = Outbox(), PublisherQueue(5, None), Decoder()
    queue.sequence_limit = 0
    count = 3000 if attributes is None else 600  # enough that what does not grow is small beside it
    decoder.decode(make.batch(5, 0).raw)  # it keeps a buffer
    tracemalloc.start()
    try:
        for index in range(count):
            raw = with_raw(make.batch(5, 1000 + index * length, length)._replace(attributes=attributes)).raw
            outbox.enqueue(queue, cast("frames.Batch", decoder.decode(bytes(raw))))
        outbox.trim()
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert 0.7 < held / outbox.held_bytes < 1.2


def test_tiny_control_frames_count_what_they_hold() -> None:
    """Case 46: unread PONGs count their objects, not only their bytes."""
    outbox = Outbox()
    tracemalloc.start()
    try:
        for token in range(10_000):
            outbox.put_control(encode(frames.Pong(token)))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held < 1.1 * outbox.undroppable_bytes


def test_queues_of_publishers_that_are_gone_are_bounded() -> None:
    """Case 49: empty ones are forgotten at once; of those with messages a peer keeps a limited number."""
    switch = Switch()
    reader, passing = switch.join("/reader"), switch.join("/passing")
    switch.send(reader, make.subscription(1))
    routes = switch.router.routes

    def come_and_go(rounds: range) -> None:
        for count in rounds:
            declared = make.publisher(1)._replace(gid=count.to_bytes(16, "big"))
            switch.send(passing, make.batch(switch.publisher(passing, declared), 0), frames.Undeclare(1))
            switch.read_all(passing)

    come_and_go(range(MAX_DEPARTED_QUEUES + 300))
    assert len(routes.peer_queues()) <= 2 * MAX_DEPARTED_QUEUES + FORGET_QUEUES
    total = routes.tallies()[0]
    assert (total.queued, total.dropped) == (MAX_DEPARTED_QUEUES, 300)
    assert collect(1, [switch.router]).departed_overflows == 300
    got = switch.read_all(reader)
    assert sum(isinstance(frame, frames.Batch) for frame in got) == MAX_DEPARTED_QUEUES
    assert sum(isinstance(frame, frames.Detached) for frame in got) == MAX_DEPARTED_QUEUES + 300
    routes.prune(at_least=0)
    assert routes.peer_queues() == []
    for count in range(2000, 2100):
        declared = make.publisher(1)._replace(gid=count.to_bytes(16, "big"))
        switch.publisher(passing, declared)
        switch.read_all(reader)
        switch.send(passing, frames.Undeclare(1))
        assert routes.peer_queues() == []
        assert {type(frame) for frame in switch.read_all(reader)} == {frames.Detached, frames.Matched}


async def test_a_full_broker_refuses_then_drops_then_closes(caplog: pytest.LogCaptureFixture) -> None:
    """Case 46: at max_broker_bytes large messages are refused, old ones go, the greediest link is closed."""
    caplog.set_level(logging.WARNING, "callboard.broker")
    limit = 4 * KIB * KIB
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(
            Broker(BrokerOptions(port=0, max_broker_bytes=limit, drain_timeout_sec=0.2))
        )
        talker, other = [
            await stack.enter_async_context(link(broker, name)) for name in ("/talker", "/other")
        ]
        talker.send(make.publisher(1), make.publisher(2, "/latched", qos=MANY), make.client(3))
        number = (await talker.next(frames.Accepted)).number
        latched = (await talker.next(frames.Accepted)).number
        other.send(make.service(1))
        deaf = await stack.enter_async_context(link(broker, "/deaf"))
        deaf.send(make.subscription(1, qos={"depth": 1000}))
        await deaf.synchronise()
        deaf.stop_reading()
        # KEEP_LAST queues: the oldest go, and no link is closed.
        for first in range(200):
            talker.send(make.batch(number, first, 1, size=100 * KIB))
            await talker.synchronise()
        stats = broker.stats()
        assert stats.held_bytes <= limit
        assert stats.dropped > 100
        assert stats.connections == 3
        deaf.channel.abort()
        await until(lambda: broker.stats().connections == 2)
        # Latched messages cannot be dropped: large messages and calls are refused first.
        while broker.stats().held_bytes <= limit - limit // 8:
            talker.send(make.batch(latched, broker.stats().latched, 1, size=100 * KIB))
            await talker.synchronise()
        talker.send(make.batch(number, 200, 1, size=KIB * KIB), make.request(3, 1, body=bytes(280 * KIB)))
        assert (await talker.next(frames.Reply)).entries[0].status == Status.OVERLOADED
        await until(lambda: broker.stats().refused_messages == 1)
        assert sum("Discarded a large message" in each.getMessage() for each in caplog.records) == 1
        # Then the link that holds most is closed, and the others go on.
        for first in range(broker.stats().latched, 1000):
            if talker.ended.done() or broker.stats().connections < 2:
                break
            talker.send(make.batch(latched, first, 1, size=100 * KIB))
            await other.synchronise()
        assert "--max-broker-bytes" in (await talker.next(frames.Error)).text
        await until(lambda: broker.stats().connections == 1)
        await other.synchronise()
        stats = broker.stats()
        assert (stats.closed_for_memory, stats.latched) == (1, 0)
        assert stats.held_bytes < limit


async def test_the_count_of_held_bytes_returns_to_zero(broker: Broker) -> None:
    """Case 46: what waited, was latched or incomplete counts until it is sent or its link has ended."""
    async with link(broker, "/talker") as talker, link(broker, "/reader") as reader:
        talker.send(make.publisher(1, qos=MANY))
        number = (await talker.next(frames.Accepted)).number
        reader.send(make.subscription(1, qos={"depth": 1000}))
        await reader.synchronise()
        reader.stop_reading()
        for first in range(50):
            talker.send(make.batch(number, first, 1, size=100 * KIB))
            await talker.synchronise()
        talker.send(*make.fragments(1, 200 * KIB))
        await talker.synchronise()
        assert broker.stats().held_bytes > 50 * 100 * KIB
        reader.go_on_reading()
        for _ in range(50):
            await reader.next(frames.Batch)
        await until(lambda: broker.stats().queued == 0)
        stats = broker.stats()
        assert stats.held_bytes == stats.latched_bytes + stats.reassembly_bytes
    await until(lambda: broker.stats().connections == 0)
    assert broker.stats().held_bytes == 0


def test_bytes_that_wait_for_their_turn_count() -> None:
    """Case 54: from the moment when they are kept until they are handled, or the connection ends."""
    for ends in (False, True):
        total, session = ByteTotal(), Session(Role.BROKER)
        session.received(frames.Hello(1, {}))
        session.sent(frames.Welcome(1, {}))
        scratch = memoryview(bytearray(SCRATCH_BYTES))
        receiver = Receiver(session, scratch, Decoder(), Reassembler(), total)
        pings = encode(frames.Ping(1)) * 10
        receiver.buffer()[: len(pings)] = pings
        receiver.received(len(pings))
        assert receiver.next_frame() is not None
        receiver.keep()
        assert total.bytes == receiver.held_bytes == len(pings) * 9 // 10
        if ends:
            receiver.discard()
        else:
            for _ in range(9):
                assert total.bytes
                assert receiver.next_frame() is not None
        assert total.bytes == 0


async def test_buffers_for_tls_count(tmp_path: Path) -> None:
    """Case 46: OpenSSL keeps as much for a connection as its largest read, until it ends."""
    authority = Authority(tmp_path)
    async with Broker(authority.options()) as broker:
        url = parse_url(broker.url)
        context = client_context(authority.files())
        reader, writer = await asyncio.open_connection(url.host, url.port, ssl=context)
        writer.write(encode(hello()))
        assert isinstance(await read_frame(reader), frames.Welcome)
        handshake = broker.stats().received_bytes
        assert handshake > 0
        writer.write(encode(frames.Ping(1)) * 10_000)
        await until(lambda: broker.stats().received_bytes > handshake + 10_000)
        assert broker.stats().held_bytes >= broker.stats().received_bytes
        writer.transport.abort()
        await until(lambda: not broker.stats().connections)
        assert broker.stats().received_bytes == 0


def test_messages_that_are_only_counted_several_times_are_no_reason_to_refuse() -> None:
    """What waits for many links is in memory once: the process must really use too much."""
    total, latched = ReassemblyTotal(), ByteTotal()
    used = [100]
    guard = MemoryGuard(1000, lambda: used[0], total, latched, ByteTotal())
    latched.bytes = 5000
    assert guard.needs_relief
    guard.relieve(())
    assert (guard.full, guard.needs_relief) == (False, False)
    used[0] = 990
    latched.bytes = 6000
    assert guard.needs_relief
    guard.relieve(())
    assert guard.full
    assert total.refusing
    latched.bytes = 0
    guard.relieve(())
    assert (guard.full, total.refusing, guard.needs_relief) == (False, False, False)
