"""The receiver without any I/O: any split gives the same frames, and nothing is kept of what is wrong."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import Decoder, encode
from proto.wire.fragments import Reassembler, Transfer
from proto.wire.receiver import PARTS, SCRATCH_BYTES, Receiver
from proto.wire.session import Role, Session
from tests.proto.outboxes import make_batch


def open_receiver(scratch: memoryview | None = None) -> Receiver:
    """Return a broker's receiver of a session that is open."""
    session = Session(Role.BROKER)
    session.received(frames.Hello(limits.PROTOCOL_VERSION, {}))
    session.sent(frames.Welcome(1, {}))
    return Receiver(
        session,
        memoryview(bytearray(SCRATCH_BYTES)) if scratch is None else scratch,
        Decoder(),
        Reassembler(),
    )


def feed(receiver: Receiver, data: bytes) -> list[frames.Frame]:
    """Give a receiver bytes as a socket would, a bufferful at a time; return the frames."""
    found: list[frames.Frame] = []
    while data:
        buffer = receiver.buffer()
        size = min(len(buffer), len(data))
        buffer[:size] = data[:size]
        data = data[size:]
        receiver.received(size)
        while (frame := receiver.next_frame()) is not None:
            if type(frame) not in PARTS:
                found.append(frame)
    return found


def stream() -> tuple[bytes, list[str]]:
    """Return small frames, one just below the frame limit, and one in fragments; and their names."""
    large = bytes(make_batch(0, [bytes(limits.MAX_FRAME_BYTES - 1000)]).raw)
    transfer = Transfer(7, bytes(make_batch(1, [bytes(3 * limits.MAX_FRAME_BYTES)]).raw))
    pieces, last = b"", False
    while not last:
        head, payload, last = transfer.next()
        pieces += head + payload
    data = encode(frames.Node(1, "/a")) + large + encode(frames.Ping(5)) + pieces + encode(frames.Pong(6))
    return data, ["Node", "Batch", "Ping", "Batch", "Pong"]


@given(st.lists(st.integers(min_value=1, max_value=400_000), max_size=30))
def test_any_split_gives_the_same_frames(sizes: list[int]) -> None:
    """Wherever the stream is cut, whole frames come out once, in order, fragments put together."""
    receiver = open_receiver()
    data, names = stream()
    found: list[frames.Frame] = []
    for size in sizes:
        found += feed(receiver, data[:size])
        data = data[size:]
    found += feed(receiver, data)
    assert [type(frame).__name__ for frame in found] == names


def test_what_follows_an_abort_comes_with_it() -> None:
    """An ABORT is a frame like others: what was read behind it does not wait for the next read."""
    receiver = open_receiver()
    head, payload, _ = Transfer(7, bytes(make_batch(1, [bytes(3 * limits.MAX_FRAME_BYTES)]).raw)).next()
    assert feed(receiver, head + payload + encode(frames.Abort(7)) + encode(frames.Pong(6))) == [
        frames.Pong(6)
    ]


def test_receivers_may_share_a_scratch_buffer() -> None:
    """Half a frame of one survives what another reads into the same buffer."""
    scratch = memoryview(bytearray(SCRATCH_BYTES))
    one, other = open_receiver(scratch), open_receiver(scratch)
    raw = encode(frames.Node(1, "/a"))
    assert feed(one, raw[:7]) == []
    assert feed(other, encode(frames.Ping(9)) * 3) == [frames.Ping(9)] * 3
    assert feed(one, raw[7:]) == [frames.Node(1, "/a")]


def test_what_is_left_of_a_read_after_an_error_is_not_taken_again() -> None:
    """Bytes behind a broken frame belong to nobody."""
    receiver = open_receiver()
    with pytest.raises(ProtocolError) as caught:
        feed(receiver, b"GET / HTTP/1.1\r\n")
    assert caught.value.code == ErrorCode.MALFORMED
    assert len(receiver.buffer()) == SCRATCH_BYTES


def test_an_unfinished_large_frame_claims_memory_only_when_an_eighth_of_it_has_come() -> None:
    """A length prefix alone leaves the receiver with its scratch buffer."""
    raw = bytes(make_batch(0, [bytes(200 * 1024)]).raw)
    receiver = open_receiver()
    assert feed(receiver, raw[:100]) == []
    assert len(receiver.buffer()) == SCRATCH_BYTES - 100
    assert feed(receiver, raw[100:40_000]) == []
    assert len(receiver.buffer()) < len(raw)
    assert len(feed(receiver, raw[40_000:])) == 1


def test_the_start_of_an_incomplete_frame_is_counted() -> None:
    """Also one too small for a buffer of its own: many links may each send a part of one and then wait."""
    receiver = open_receiver()
    data = bytes(make_batch(0, [bytes(90_000)]).raw)
    assert feed(receiver, data[:80_000]) == []
    assert receiver.held_bytes == 80_000
    assert len(feed(receiver, data[80_000:])) == 1
    assert receiver.held_bytes == 0
    assert feed(receiver, data[:80_000]) == []
    receiver.discard()
    assert receiver.held_bytes == 0
