"""Batches compared with plain lists of messages."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.queues.batches import (
    MAX_HEAD_BYTES,
    BatchBuilder,
    fitting_stop,
    message_bytes,
    slice_batch,
    split_messages,
    with_publisher,
    with_raw,
)
from proto.wire.codec import decode, encode
from proto.wire.frames import Batch, Replay
from proto.wire.stamps import MAX_STAMPS, stamp_of, stamps_attribute, stamps_from

MESSAGES = st.lists(st.binary(min_size=1, max_size=30), min_size=1, max_size=12)


def build(parts: list[bytes], *, first: int = 100, publisher: int = 7) -> Batch:
    """Build a batch of these messages."""
    builder = BatchBuilder(first)
    for part in parts:
        builder.add(part)
    return builder.build(publisher, 5)


def parts_of(batch: Batch) -> list[bytes]:
    """Return the messages of a batch after encoding and decoding it."""
    back = decode(bytes(batch.raw))
    assert isinstance(back, Batch)
    assert back[:6] == batch[:6]
    assert bytes(back.payload) == bytes(batch.payload)
    return [bytes(message) for message in split_messages(batch)]


@given(MESSAGES)
def test_a_batch_has_the_added_messages(parts: list[bytes]) -> None:
    """§6: count, bytes and messages of a batch are those of the list it was built from."""
    batch = build(parts)
    assert parts_of(batch) == parts
    assert batch.length == len(parts)
    assert message_bytes(batch) == sum(map(len, parts))


def test_the_parts_of_a_batch_have_only_their_own_times() -> None:
    """§6.1.7: sent message by message, a batch of 400 takes a few times its bytes, and no time changes."""
    stamps = [10**18 + 7 * number for number in range(MAX_STAMPS)]
    builder = BatchBuilder(100)
    for _ in stamps:
        builder.add(b"a message")
    whole = builder.build(7, stamps[0], {"other": 1, **(stamps_attribute(100, stamps) or {})})
    sent, rest = 0, whole
    found: list[int] = []
    for _ in stamps:
        part, rest = slice_batch(rest, 0, 1), slice_batch(rest, min(1, rest.length - 1), rest.length)
        sent += len(part.raw)
        assert part.attributes is not None
        assert part.attributes["other"] == 1
        number = part.first_sequence
        found.append(stamp_of(stamps_from(part.attributes, number, 1), number, 0))
    assert found == stamps
    assert sent < 8 * len(whole.raw)


@given(MESSAGES, st.data())
def test_a_slice_has_the_sliced_messages(parts: list[bytes], data: st.DataObject) -> None:
    """§6: a sliced batch has the messages of the slice under their numbers."""
    start = data.draw(st.integers(0, len(parts) - 1))
    stop = data.draw(st.integers(start + 1, len(parts)))
    piece = slice_batch(build(parts), start, stop)
    assert parts_of(piece) == parts[start:stop]
    assert piece.first_sequence == 100 + start
    assert (piece.publisher, piece.stamp_ns) == (7, 5)


@given(MESSAGES, st.data())
def test_a_fitting_stop_is_the_first_message_beyond_the_limit(
    parts: list[bytes], data: st.DataObject
) -> None:
    """§6: every message before it begins within the limit, and it does not."""
    start = data.draw(st.integers(0, len(parts) - 1))
    room = data.draw(st.integers(1, 200))
    stop = fitting_stop(build(parts), start, room)
    begins = [sum(map(len, parts[start:index])) for index in range(start, len(parts))]
    assert stop == start + sum(begin < room for begin in begins)


@given(MESSAGES, st.integers(0, limits.MAX_U64))
def test_with_publisher_changes_only_the_publisher(parts: list[bytes], publisher: int) -> None:
    """§6: a batch with a new id is otherwise equal; with its own id it is the same object."""
    batch = build(parts)
    moved = with_publisher(batch, publisher)
    assert moved.publisher == publisher
    assert moved[1:6] == batch[1:6]
    assert parts_of(moved) == parts
    assert with_publisher(moved, publisher) is moved


def test_nothing_is_copied_without_need() -> None:
    """A slice of everything is the batch itself, and messages are views into its encoded bytes."""
    batch = build([b"a", b"bc"])
    assert slice_batch(batch, 0, 2) is batch
    assert isinstance(batch.payload, memoryview)
    assert batch.payload.obj is batch.raw
    assert all(message.obj is batch.raw for message in split_messages(batch))


def test_messages_of_a_replay() -> None:
    """A REPLAY is split like a batch."""
    batch = build([b"a", b"bc"])
    replay = decode(encode(Replay(3, *batch[:7])))
    assert isinstance(replay, Replay)
    assert [bytes(message) for message in split_messages(replay)] == [b"a", b"bc"]
    assert message_bytes(replay) == 3


def test_the_builder_continues_after_take() -> None:
    """Numbers continue, and the next batch has new messages only."""
    builder = BatchBuilder(10)
    for part in (b"a", b"b", b"c"):
        builder.add(part)
    first = builder.build(1, 0)
    builder.add(b"d")
    second = builder.build(1, 0)
    assert (first.first_sequence, first.length, second.first_sequence) == (10, 3, 13)
    assert parts_of(second) == [b"d"]
    assert (builder.length, builder.next_sequence) == (0, 14)


def test_the_builder_reports_a_full_batch() -> None:
    """§6: a batch is due at BATCH_FLUSH_BYTES or BATCH_FLUSH_COUNT, whichever is reached first."""
    builder = BatchBuilder(0)
    assert not builder.add(bytes(limits.BATCH_FLUSH_BYTES - 1))
    assert builder.add(b"x")
    builder.build(1, 0)
    full = [builder.add(b"x") for _ in range(limits.BATCH_FLUSH_COUNT)]
    assert full == [False] * (limits.BATCH_FLUSH_COUNT - 1) + [True]


def test_with_raw_keeps_the_fields() -> None:
    """Encoding a batch sets `raw` and changes nothing else."""
    batch = build([b"a"])
    again = with_raw(batch._replace(raw=b""))
    assert again.raw == batch.raw


@pytest.mark.parametrize("number", [0, limits.MAX_U64 - 10])
def test_a_single_large_message_is_a_batch(number: int) -> None:
    """§6: it is numbered like any other, and it is not copied; the longest head still fits before it."""
    builder = BatchBuilder(number)
    builder.add(b"a")
    builder.build(7, 5)
    buffer = bytearray(MAX_HEAD_BYTES) + b"large"
    batch = builder.single(buffer, limits.MAX_U64, limits.MAX_U64)
    back = decode(bytes(batch.raw))
    assert isinstance(back, Batch)
    assert [bytes(message) for message in split_messages(back)] == [b"large"]
    assert back[:6] == (limits.MAX_U64, number + 1, limits.MAX_U64, 1, None, None)
    assert builder.next_sequence == number + 2
    assert memoryview(batch.raw).obj is memoryview(batch.payload).obj is buffer
    assert memoryview(batch.raw).readonly
