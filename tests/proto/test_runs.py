"""Runs against a plain list of messages: building, cutting, addressing and splitting change nothing else."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto import limits
from proto.codec import decode, encode
from proto.frames import Replay, Run
from proto.runs import HEAD_ROOM, RunBuilder, cut, fitting, message_bytes, messages, readdress, with_raw

MODEST = settings(deadline=None, max_examples=100)
MESSAGES = st.lists(st.binary(min_size=1, max_size=30), min_size=1, max_size=12)


def build(parts: list[bytes], *, first: int = 100, publisher: int = 7) -> Run:
    """Build a run of these messages."""
    builder = RunBuilder(first)
    for part in parts:
        builder.add(part)
    return builder.take(publisher, 5)


def parts_of(run: Run) -> list[bytes]:
    """Return a run's messages, after a trip over the wire."""
    back = decode(bytes(run.raw))
    assert isinstance(back, Run)
    assert back[:6] == run[:6]
    assert bytes(back.payload) == bytes(run.payload)
    return [bytes(message) for message in messages(run)]


@MODEST
@given(MESSAGES)
def test_a_run_holds_what_was_put_in(parts: list[bytes]) -> None:
    """§6: count, bytes and messages of a run are those of the list it was built from."""
    run = build(parts)
    assert parts_of(run) == parts
    assert run.length == len(parts)
    assert message_bytes(run) == sum(map(len, parts))


@MODEST
@given(MESSAGES, st.data())
def test_cut_is_a_slice(parts: list[bytes], data: st.DataObject) -> None:
    """§6: a cut run holds the slice, numbered on from its first message."""
    start = data.draw(st.integers(0, len(parts) - 1))
    stop = data.draw(st.integers(start + 1, len(parts)))
    piece = cut(build(parts), start, stop)
    assert parts_of(piece) == parts[start:stop]
    assert piece.first_sequence == 100 + start
    assert (piece.publisher, piece.stamp_ns) == (7, 5)


@MODEST
@given(MESSAGES, st.data())
def test_fitting_stops_where_the_room_ends(parts: list[bytes], data: st.DataObject) -> None:
    """§6: every message taken begins within the room, and the next one would not."""
    start = data.draw(st.integers(0, len(parts) - 1))
    room = data.draw(st.integers(1, 200))
    stop = fitting(build(parts), start, room)
    begins = [sum(map(len, parts[start:index])) for index in range(start, len(parts))]
    assert stop == start + sum(begin < room for begin in begins)


@MODEST
@given(MESSAGES, st.integers(0, limits.MAX_U64))
def test_readdress_changes_only_the_publisher(parts: list[bytes], publisher: int) -> None:
    """§6: a run under a new id is otherwise the same; under its own id it is the same object."""
    run = build(parts)
    moved = readdress(run, publisher)
    assert moved.publisher == publisher
    assert moved[1:6] == run[1:6]
    assert parts_of(moved) == parts
    assert readdress(moved, publisher) is moved


def test_nothing_is_copied_without_need() -> None:
    """A whole cut is the run itself, and messages and payload are views into its encoded bytes."""
    run = build([b"a", b"bc"])
    assert cut(run, 0, 2) is run
    assert isinstance(run.payload, memoryview)
    assert run.payload.obj is run.raw
    assert all(message.obj is run.raw for message in messages(run))


def test_messages_of_a_replay() -> None:
    """A REPLAY is split as a run is."""
    run = build([b"a", b"bc"])
    replay = decode(encode(Replay(3, *run[:7])))
    assert isinstance(replay, Replay)
    assert [bytes(message) for message in messages(replay)] == [b"a", b"bc"]
    assert message_bytes(replay) == 3


def test_the_builder_goes_on_after_take() -> None:
    """Numbers continue, and what was taken is not in the next run."""
    builder = RunBuilder(10)
    for part in (b"a", b"b", b"c"):
        builder.add(part)
    first = builder.take(1, 0)
    builder.add(b"d")
    second = builder.take(1, 0)
    assert (first.first_sequence, first.length, second.first_sequence) == (10, 3, 13)
    assert parts_of(second) == [b"d"]
    assert (builder.length, builder.next_sequence) == (0, 14)


def test_the_builder_says_when_a_run_is_full() -> None:
    """§6: a run goes at RUN_FLUSH_BYTES or RUN_FLUSH_COUNT, whichever comes first."""
    builder = RunBuilder(0)
    assert not builder.add(bytes(limits.RUN_FLUSH_BYTES - 1))
    assert builder.add(b"x")
    builder.take(1, 0)
    full = [builder.add(b"x") for _ in range(limits.RUN_FLUSH_COUNT)]
    assert full == [False] * (limits.RUN_FLUSH_COUNT - 1) + [True]


def test_with_raw_keeps_the_fields() -> None:
    """Encoding a run fills `raw` and leaves the rest alone."""
    run = build([b"a"])
    again = with_raw(run._replace(raw=b""))
    assert again.raw == run.raw


@pytest.mark.parametrize("number", [0, limits.MAX_U64 - 10])
def test_a_single_large_message_is_a_run_of_its_own(number: int) -> None:
    """§6: it is numbered like any other, and it is not copied; the longest head still fits before it."""
    builder = RunBuilder(number)
    builder.add(b"a")
    builder.take(7, 5)
    buffer = bytearray(HEAD_ROOM) + b"large"
    run = builder.single(buffer, limits.MAX_U64, limits.MAX_U64)
    back = decode(bytes(run.raw))
    assert isinstance(back, Run)
    assert [bytes(message) for message in messages(back)] == [b"large"]
    assert back[:6] == (limits.MAX_U64, number + 1, limits.MAX_U64, 1, None, None)
    assert builder.next_sequence == number + 2
    assert memoryview(run.raw).obj is memoryview(run.payload).obj is buffer
    assert memoryview(run.raw).readonly
