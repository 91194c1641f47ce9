"""A channel over a fake transport and loop: any split, any hostile bytes, any full transport."""

from __future__ import annotations

import asyncio
import socket
import threading
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.aio import channel as aio
from proto.aio.channel import Channel
from proto.errors import ErrorCode, ProtocolError
from proto.queues.batches import BatchBuilder
from proto.queues.publisher_queue import PublisherQueue
from proto.wire import frames
from proto.wire.codec import array_head, encode
from proto.wire.fragments import Transfer
from proto.wire.frames import Batch, Frame, Ping, ReplyEntry, RequestEntry
from proto.wire.receiver import SCRATCH_BYTES
from proto.wire.session import Role, State
from tests.allocations import TRIES, peak_bytes
from tests.proto.aio.bench import Bench, Recorder
from tests.seams.protocol import is_lingering

CHUNKS = st.lists(st.binary(min_size=1, max_size=40), max_size=6)


def plain(frame: Frame) -> object:
    """Return a frame in a form that compares."""
    return encode(frame)


def batch_of(*parts: bytes, first: int = 0) -> Batch:
    """Build a batch."""
    builder = BatchBuilder(first)
    for part in parts:
        builder.add(part)
    return builder.build(1, 0)


SAMPLES: tuple[Frame, ...] = (
    frames.Node(1, "/a"),
    frames.Client(3, 1, "/s", "pkg/srv/S", "RIHS01_x"),
    frames.Request(3, (RequestEntry(1, 100, None, b"body"), RequestEntry(2, None, {"k": 1}, bytes(300)))),
    frames.Reply(3, (ReplyEntry(1, 0, False, None, b""),)),
    frames.Cancel(3, tuple(range(100))),
    frames.Credit(2**40, None, 5),
    frames.Pong(4),
    frames.Grant(1, 2, 3, 4),
    batch_of(b"\x01"),
    batch_of(b"\xa1a", bytes(700), b"\x02", first=9),
)


@given(st.lists(st.sampled_from(SAMPLES), max_size=12), st.data())
def test_any_split_of_the_stream_gives_the_same_frames(sent: list[Frame], data: st.DataObject) -> None:
    """Hostile case 5: frames cut at any bytes, whole or in fragments, come back as they were."""
    stream = b"".join(
        piece
        for index, frame in enumerate(sent)
        for piece in as_sent(frame, index, large=data.draw(st.booleans()))
    )
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    bench = Bench()
    for start, stop in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        bench.feed(stream[start:stop])
    assert [plain(frame) for frame in bench.handler.frames] == [plain(frame) for frame in sent]
    assert bench.channel.bytes_received == len(stream)
    assert not bench.handler.failures


def as_sent(frame: Frame, index: int, *, large: bool) -> list[bytes]:
    """Encode a frame, in fragments if it may travel so."""
    raw = encode(frame)
    if not large or not isinstance(frame, frames.Batch | frames.Request | frames.Reply):
        return [raw]
    whole = [encode(frames.Fragment(index, len(raw), True, raw[:7]))]
    return [*whole, encode(frames.Fragment(index, None, False, raw[7:]))]


def test_every_single_cut() -> None:
    """Hostile case 5: a session cut once at each byte, and one fed byte by byte, gives the same frames."""
    stream = b"".join(map(encode, SAMPLES[:4]))
    for cut in range(len(stream)):
        bench = Bench()
        bench.feed(stream[:cut])
        bench.feed(stream[cut:])
        assert len(bench.handler.frames) == 4
    bench = Bench()
    for byte in stream:
        bench.feed(bytes([byte]))
    assert len(bench.handler.frames) == 4


def test_the_handshake_and_what_follows_may_come_in_one_read() -> None:
    """§3: the limit before OPEN holds for each frame, not for what happened to be read with it."""
    bench = Bench(Role.CLIENT, State.GREETED)
    large = batch_of(bytes(3 * limits.MAX_HELLO_BYTES))
    bench.feed(encode(frames.Welcome(1, {})) + bytes(large.raw))
    assert [type(frame) for frame in bench.handler.frames] == [frames.Welcome, Batch]


@pytest.mark.parametrize("state", [State.START, State.OPEN])
def test_frames_of_exactly_the_limit(state: State) -> None:
    """Hostile case 31: a frame of the limit passes wherever it is cut; one byte more is TOO_LARGE."""
    most = limits.MAX_FRAME_BYTES if state is State.OPEN else limits.MAX_HELLO_BYTES
    if state is State.OPEN:
        overhead = len(batch_of(b"").raw) - limits.PREFIX_BYTES
        raw = bytes(batch_of(bytes(most - overhead)).raw)
    else:
        raw = encode(frames.Hello(1, {str(index): b"x" * 62 for index in range(60)}))
        raw = encode(frames.Hello(1, {**dict.fromkeys(map(str, range(60)), b"x" * 62), "k": b""}))
        missing = most + limits.PREFIX_BYTES - len(raw)
        raw = encode(frames.Hello(1, {**dict.fromkeys(map(str, range(60)), b"x" * 62), "k": b"x" * missing}))
    assert len(raw) == most + limits.PREFIX_BYTES
    for cut in (1, 4, 5, 6, len(raw) - 1, len(raw)):
        bench = Bench(state=state)
        bench.feed(raw[:cut])
        bench.feed(raw[cut:])
        assert len(bench.handler.frames) == 1
        assert len(bench.channel.get_buffer(-1)) == SCRATCH_BYTES
    bench = Bench(state=state)
    bench.feed(b"\xc6" + (most + 1).to_bytes(4, "big"))
    assert bench.farewell().code == ErrorCode.TOO_LARGE


@given(
    st.lists(st.binary(min_size=1, max_size=40), max_size=6), st.sampled_from(State), st.sampled_from(Role)
)
def test_hostile_streams_end_in_one_error_frame(chunks: list[bytes], state: State, role: Role) -> None:
    """Any bytes in any state leave the channel waiting for more, or closed with one ERROR; nothing raises."""
    bench = Bench(role, state)
    for chunk in chunks:
        bench.feed(chunk)
        bench.feed(b"\xc6\x00\x00\x00" + bytes([len(chunk)]) + chunk)
    if bench.handler.failures:
        assert len(bench.handler.failures) == 1
        assert bench.farewell().code == bench.handler.failures[0].code
    assert len(bench.transport.written) <= 1 or state in {State.OPEN, State.CLOSING}


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", ErrorCode.MALFORMED),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", ErrorCode.MALFORMED),
        (b"SSH-2.0-OpenSSH_9.6\r\n", ErrorCode.MALFORMED),
        (b"\x00", ErrorCode.MALFORMED),
        (b"\xc6\xff\xff\xff\xff", ErrorCode.TOO_LARGE),
        (b"\xc6\x00\x00\x00\x00", ErrorCode.MALFORMED),
        (encode(Ping(1)), ErrorCode.UNEXPECTED),
        (encode(frames.Goodbye("")), ErrorCode.UNEXPECTED),
        (encode(frames.Welcome(1, {})), ErrorCode.UNEXPECTED),
        (encode(frames.Hello(1, {})) * 2, ErrorCode.UNEXPECTED),
    ],
    ids=["HTTP", "TLS", "SSH", "zero", "4 GiB", "zero length", "ping", "goodbye", "welcome", "hello twice"],
)
def test_a_rejected_peer_gets_the_reason(data: bytes, code: ErrorCode) -> None:
    """Hostile cases 3, 4, 6, 7: the connection gets one ERROR frame with the reason and is closed."""
    bench = Bench(state=State.START)
    bench.feed(data)
    assert bench.farewell().code == code
    assert [error.code for error in bench.handler.failures] == [code]


def test_a_large_claim_costs_no_memory() -> None:
    """Hostile case 3: announcing a frame of the limit and then nothing holds five bytes."""
    benches = iter([Bench() for _ in range(50 * TRIES)])

    def feed() -> None:
        for bench in islice(benches, 50):
            bench.feed(b"\xc6" + limits.MAX_FRAME_BYTES.to_bytes(4, "big"))

    assert peak_bytes(feed) < 64 * 1024


def test_frames_before_the_bad_bytes_count_and_those_after_do_not() -> None:
    """§4: what came before an error has been handled; what comes after it is not looked at."""
    bench = Bench()
    bench.feed(encode(frames.Node(1, "/a")) + b"\xc6\0\0\0\x02\x91\x63" + encode(frames.Node(2, "/b")))
    bench.channel.buffer_updated(3)
    assert bench.handler.frames == [frames.Node(1, "/a")]
    assert bench.farewell().code == ErrorCode.MALFORMED
    assert bench.handler.events.count("batch") == 1


def test_fragments_that_are_not_one_frame() -> None:
    """§6: parts whose prefix does not say their size are MALFORMED."""
    for raw in (bytes(20), bytes(batch_of(b"abc").raw) + b"x", bytes(batch_of(b"abc").raw)[:-1]):
        bench = Bench()
        bench.feed(encode(frames.Fragment(1, len(raw), False, raw)))
        assert bench.farewell().code == ErrorCode.MALFORMED


@pytest.mark.parametrize(
    "inner", [Ping(1), frames.Error(1, ""), frames.Goodbye(""), frames.Fragment(1, 1, False, b"x")]
)
def test_only_messages_and_calls_travel_in_fragments(inner: Frame) -> None:
    """§6: session frames, fragments in fragments and the like are UNEXPECTED."""
    raw = encode(inner)
    bench = Bench()
    bench.feed(encode(frames.Fragment(1, len(raw), False, raw)))
    assert bench.farewell().code == ErrorCode.UNEXPECTED


def test_the_message_limit_is_the_owners() -> None:
    """Hostile case 31: a total over the channel's limit is TOO_LARGE, before any of it is kept."""
    bench = Bench(most=1000)
    bench.feed(encode(frames.Fragment(1, 1001, True, b"x")))
    assert bench.farewell().code == ErrorCode.TOO_LARGE


def test_an_aborted_transfer_is_not_handed_over() -> None:
    """§6: ABORT ends a transfer, and the handler does not see it."""
    bench = Bench()
    bench.feed(encode(frames.Fragment(1, 10, True, b"x")) + encode(frames.Abort(1)) + encode(frames.Abort(2)))
    assert not bench.handler.frames
    assert bench.channel.connected


def test_ping_is_answered_in_order() -> None:
    """§4: each PING gets its PONG, and the handler does not see it."""
    bench = Bench()
    bench.feed(encode(Ping(5)) + encode(Ping(6)))
    bench.loop.turn()
    assert bench.transport.sent() == [frames.Pong(5), frames.Pong(6)]
    assert not bench.handler.frames


def test_an_error_raised_by_the_handler_closes_with_its_code() -> None:
    """A ProtocolError from `frame_received` ends the connection as one of the codec's does."""
    bench = Bench()

    def refuse(frame: Frame) -> None:
        raise ProtocolError(ErrorCode.CREDIT, "too much")

    bench.handler.react = refuse
    bench.feed(encode(frames.Node(1, "/a")) * 2)
    assert bench.farewell() == frames.Error(ErrorCode.CREDIT, "too much")
    assert len(bench.handler.frames) == 1


def test_a_bug_in_the_handler_is_not_swallowed() -> None:
    """Anything else it raises goes to the loop, and the rest of the read is not handled a second time."""
    bench = Bench()

    def stumble(frame: Frame) -> None:
        raise ZeroDivisionError

    bench.handler.react = stumble
    with pytest.raises(ZeroDivisionError):
        bench.feed(encode(frames.Node(1, "/a")) * 2)
    assert len(bench.channel.get_buffer(-1)) == SCRATCH_BYTES


def test_an_error_from_the_peer_is_handed_over_and_ends_the_connection() -> None:
    """§4: the receiver of an ERROR closes and sends nothing."""
    bench = Bench()
    bench.feed(encode(frames.Error(3, "why")) + encode(frames.Node(1, "/a")))
    assert bench.handler.frames == [frames.Error(3, "why")]
    assert bench.transport.closing
    assert not bench.transport.written
    assert not bench.handler.failures


def test_after_close_nothing_more_is_read_or_written() -> None:
    """Frames behind the one at which the owner closed are not handed over; a late flush writes nothing."""
    bench = Bench()
    bench.handler.react = lambda frame: bench.channel.close()
    bench.feed(encode(frames.Node(1, "/a")) * 2)
    assert len(bench.handler.frames) == 1
    assert not bench.channel.connected
    bench.channel.send(Ping(1))
    bench.loop.turn()
    bench.channel.fail(ProtocolError(ErrorCode.LIMIT, "late"))
    assert not bench.transport.written
    assert not bench.handler.failures


def test_a_peer_that_does_not_read_is_cut_off() -> None:
    """Closing takes at most CLOSE_TIMEOUT_SEC; the timer goes with the connection."""
    bench = Bench()
    bench.channel.close()
    bench.channel.close()
    assert [timer.delay for timer in bench.loop.later] == [limits.CLOSE_TIMEOUT_SEC]
    bench.loop.later[0].callback()
    assert bench.transport.aborted
    bench.channel.connection_lost(None)
    assert bench.loop.later[0].cancelled
    assert bench.handler.events == ["opened", "closed"]


def test_a_connection_that_is_gone_takes_everything() -> None:
    """Once closed, every method may still be called and does nothing."""
    bench = Bench()
    bench.channel.connection_lost(ConnectionResetError())
    bench.channel.send(Ping(1))
    bench.channel.flush()
    bench.channel.fail(ProtocolError(ErrorCode.LIMIT, ""))
    bench.channel.close()
    bench.channel.abort()
    bench.channel.resume_writing()
    assert not bench.channel.descriptors()
    assert not bench.channel.connected
    assert not bench.transport.written
    assert bench.handler.events.count("closed") == 1


def test_half_closed_means_closed() -> None:
    """§2: the end of the peer's stream ends the connection."""
    bench = Bench()
    assert bench.channel.eof_received() is False
    assert not bench.channel.connected
    assert is_lingering(bench.channel)  # a peer that does not read is not waited for


def test_one_flush_is_scheduled_per_turn() -> None:
    """However often something is sent in one loop turn, one call is scheduled and one write made."""
    bench = Bench()
    for token in range(100):
        bench.channel.send(frames.Pong(token))
        bench.channel.flush_soon()
    assert len(bench.loop.soon) == 1
    bench.loop.turn()
    assert len(bench.transport.written) == 1
    assert bench.transport.sent() == [frames.Pong(token) for token in range(100)]
    bench.channel.flush_soon()
    assert len(bench.loop.soon) == 1


def test_small_frames_are_joined_and_a_lone_one_is_passed_on() -> None:
    """Up to a size frames go in one copy; a lone frame is passed on without one."""
    bench = Bench()
    batch = batch_of(bytes(200 * 1024))
    bench.channel.outbox.enqueue(PublisherQueue(1, None), batch)
    bench.channel.flush()
    assert bench.transport.written == [batch.raw]
    raws = [encode(frames.Pong(token)) for token in range(100)]
    for raw in raws:
        bench.channel.outbox.put_control(raw)
    bench.channel.flush()
    assert bench.transport.written[1:] == [b"".join(raws)]
    assert bench.channel.bytes_sent == len(batch.raw) + sum(map(len, raws))


def test_frames_that_are_large_together_are_written_without_a_copy() -> None:
    """Many frames leave in writes of about the gathering size, none of them copied."""
    bench = Bench()
    queue = PublisherQueue(1, None)
    batches = [batch_of(bytes(50 * 1024), first=number) for number in range(20)]
    for batch in batches:
        bench.channel.outbox.enqueue(queue, batch)
    bench.channel.flush()
    lists = bench.transport.lists
    assert [part for parts in lists for part in parts] == [batch.raw for batch in batches]
    assert all(part is batch.raw for part, batch in zip(lists[0], batches, strict=False))
    assert all(sum(map(len, parts)) >= aio.GATHER_BYTES for parts in lists[:-1])


def test_a_full_transport_holds_the_rest_and_trims_it() -> None:
    """A transport that is full after a `write` gets nothing more; queues are trimmed to their depth."""
    bench = Bench(space=100)
    queue = PublisherQueue(1, 2)
    bench.channel.outbox.enqueue(queue, batch_of(bytes(200)))
    bench.channel.flush()
    assert bench.channel.busy
    for sequence in range(1, 6):
        bench.channel.outbox.enqueue(queue, batch_of(b"x", first=sequence))
        bench.channel.flush()
    assert (len(bench.transport.written), queue.pending, queue.dropped) == (1, 2, 3)
    bench.transport.space = None
    bench.channel.resume_writing()
    assert [frame.first_sequence for frame in bench.transport.sent() if isinstance(frame, Batch)] == [0, 4, 5]
    assert bench.handler.events == ["opened", "writable"]


def test_writable_is_not_called_while_the_transport_is_full_again() -> None:
    """`writable` means that the outbox is flushed and the transport takes more."""
    bench = Bench(space=100)
    for first in (0, 1):
        bench.channel.outbox.enqueue(PublisherQueue(1, None), batch_of(bytes(aio.GATHER_BYTES), first=first))
    bench.channel.flush()
    bench.transport.space = 100
    bench.channel.resume_writing()
    assert bench.channel.busy
    assert "writable" not in bench.handler.events


def test_a_large_message_leaves_in_frames_of_the_limit() -> None:
    """§6: what a channel writes for a large message, another reads as one."""
    bench, other = Bench(), Bench(Role.CLIENT, most=limits.MAX_MESSAGE_BYTES)
    batch = batch_of(bytes(3 * limits.MAX_FRAME_BYTES))
    bench.channel.outbox.enqueue(PublisherQueue(1, None), batch)
    bench.channel.flush()
    while bench.loop.soon:
        bench.loop.turn()
    other.feed(b"".join(bench.transport.written))
    (frame,) = other.handler.frames
    assert isinstance(frame, Batch)
    assert bytes(frame.raw) == batch.raw


def test_large_messages_are_sent_in_parts_and_small_ones_at_once() -> None:
    """§6: a large message uses a part of each loop turn; a later small one does not wait for its end."""
    bench = Bench()
    large, small = PublisherQueue(1, None), PublisherQueue(2, None)
    bench.channel.outbox.enqueue(large, batch_of(bytes(20 * limits.FRAGMENT_BYTES)))
    bench.channel.flush()
    first = sum(map(len, bench.transport.written))
    assert aio.TURN_BYTES <= first <= aio.TURN_BYTES + limits.FRAGMENT_BYTES + 100
    bench.transport.sent()
    for sequence in range(10):
        bench.channel.outbox.enqueue(small, batch_of(b"x", first=sequence))
    bench.loop.turn()
    kinds = [type(frame) for frame in bench.transport.sent()]
    assert kinds.count(Batch) == 10
    assert 0 < kinds.count(frames.Fragment) < 10
    while bench.loop.soon:
        bench.loop.turn()
    assert large.empty
    assert bench.handler.events.count("writable") > 1


def test_reading_from_a_flooding_peer_pauses_for_a_turn() -> None:
    """A peer whose reads fill their buffers is read again only after the other connections."""
    bench = Bench()
    raw = encode(frames.Pong(1))
    stream = raw * (len(bench.channel.get_buffer(-1)) // len(raw) + 1)
    bench.feed(stream)
    assert bench.transport.reading is False
    assert len(bench.handler.frames) == len(stream) // len(raw)
    bench.loop.turn()
    assert bench.transport.reading is True
    bench.feed(raw)
    assert bench.transport.reading is True


def test_a_channel_closed_while_reading_is_paused_stays_closed() -> None:
    """Reading is not resumed on a closing transport."""
    bench = Bench()
    raw = encode(frames.Pong(1))
    bench.feed(raw * (len(bench.channel.get_buffer(-1)) // len(raw) + 1))
    bench.channel.abort()
    bench.loop.turn()
    assert bench.transport.reading is False


@pytest.mark.parametrize("size", [1000, 96 * 1024, 3 * limits.MAX_FRAME_BYTES])
def test_what_is_received_cannot_be_changed(size: int) -> None:
    """Several subscriptions share a message's bytes, so they are read-only."""
    sender, bench = Bench(), Bench(Role.CLIENT)
    sender.channel.outbox.enqueue(PublisherQueue(1, None), batch_of(bytes(size)))
    sender.channel.flush()
    while sender.loop.soon:
        sender.loop.turn()
    stream = b"".join(sender.transport.written)
    for start in range(0, len(stream), 40_000):
        bench.feed(stream[start : start + 40_000])
    (batch,) = bench.handler.frames
    assert isinstance(batch, Batch)
    assert len(batch.payload) > size
    assert memoryview(batch.payload).readonly
    assert memoryview(batch.raw).readonly


def test_half_a_frame_is_a_sign_of_life() -> None:
    """§4.3.1: any bytes count, also those of half a frame."""
    bench = Bench()
    before = bench.channel.bytes_received
    bench.feed(b"\xc6")
    assert bench.channel.bytes_received == before + 1


def test_loops_in_two_threads_do_not_share_a_buffer() -> None:
    """While one thread's loop is reading into its buffer, another's may do the same."""
    buffers: list[object] = []

    def look() -> None:
        buffers.append(Bench().channel.get_buffer(-1).obj)

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    look()
    look()
    assert buffers[0] is not buffers[1]
    assert buffers[1] is buffers[2]


def test_transfers_of_two_channels_do_not_mix() -> None:
    """Half a frame of one connection survives a read of another in the shared buffer."""
    one, two = Bench(), Bench()
    raw = bytes(batch_of(bytes(1000)).raw)
    one.feed(raw[:500])
    two.feed(encode(frames.Node(1, "/a")) + raw[:900])
    one.feed(raw[500:])
    two.feed(raw[900:])
    assert [plain(frame) for frame in one.handler.frames] == [raw]
    assert [plain(frame) for frame in two.handler.frames] == [encode(frames.Node(1, "/a")), raw]


async def test_a_reader_that_does_not_read_makes_the_transport_full() -> None:
    """With any loop, the transport holds a bounded number of bytes and the rest waits in the outbox."""
    loop = asyncio.get_running_loop()
    ours, theirs = socket.socketpair()
    channel = Channel(Role.BROKER, Recorder(), loop=loop)
    transport, _ = await loop.create_connection(lambda: channel, sock=ours)
    queue = PublisherQueue(1, None)
    for number in range(200):
        channel.outbox.enqueue(queue, batch_of(bytes(50 * 1024), first=number))
    channel.flush()
    assert channel.busy
    assert queue.pending > 100
    assert transport.get_write_buffer_size() < 2 * aio.GATHER_BYTES
    transport.abort()
    theirs.close()
    await asyncio.sleep(0)


async def test_over_a_real_socket() -> None:
    """Two channels on a socket pair: handshake, a large message, an error, and both handlers are closed."""
    loop = asyncio.get_running_loop()
    ended = {role: asyncio.Event() for role in Role}
    came = asyncio.Event()
    handlers = {role: Recorder() for role in Role}
    channels = {role: Channel(role, handlers[role], loop=loop) for role in Role}
    for role in Role:
        handlers[role].closed = lambda error, role=role: ended[role].set()  # type: ignore[method-assign, misc]
    broker, client = channels[Role.BROKER], channels[Role.CLIENT]
    handlers[Role.BROKER].react = lambda frame: (
        broker.send(frames.Welcome(1, {})) if isinstance(frame, frames.Hello) else came.set()
    )
    payload = array_head(1) + bytes(5 * limits.MAX_FRAME_BYTES)
    raw = encode(Batch(1, 0, 0, 1, None, None, payload, b""))

    def publish(frame: Frame) -> None:
        if isinstance(frame, frames.Welcome):
            transfer = Transfer(1, raw)
            last = False
            while not last:
                head, payload, last = transfer.next()
                client.outbox.put_control(head + payload)
            client.flush_soon()

    handlers[Role.CLIENT].react = publish
    for channel, sock in zip((broker, client), socket.socketpair(), strict=True):
        await loop.create_connection(lambda channel=channel: channel, sock=sock)  # type: ignore[misc]
    client.send(frames.Hello(1, {}))
    await came.wait()
    batch = handlers[Role.BROKER].frames[-1]
    assert isinstance(batch, Batch)
    assert batch.raw == raw
    assert broker.descriptors()
    broker.fail(ProtocolError(ErrorCode.TAKEN_OVER, "another link"))
    await ended[Role.BROKER].wait()
    await ended[Role.CLIENT].wait()
    assert handlers[Role.CLIENT].frames[-1] == frames.Error(ErrorCode.TAKEN_OVER, "another link")
