"""Lanes: depth in messages however they travel, ceilings in bytes, and counts of all that went in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.codec import decode
from proto.frames import Run
from proto.lane import Lane
from proto.outbox import Outbox
from tests.proto.outboxes import drain, make_run, take_one

if TYPE_CHECKING:
    import pytest


def numbers(raw: bytes) -> list[int]:
    """Return the sequence numbers of a run's messages."""
    run = decode(raw)
    assert isinstance(run, Run)
    return list(range(run.first_sequence, run.first_sequence + run.length))


@given(
    depth=st.integers(1, 12),
    turns=st.lists(st.tuples(st.lists(st.integers(1, 9), max_size=4), st.integers(0, 3)), max_size=20),
)
def test_what_cannot_leave_is_cut_to_exactly_the_newest(
    depth: int, turns: list[tuple[list[int], int]]
) -> None:
    """§6.4.1: in each turn some runs come and some frames leave; of the rest, `depth` messages stay."""
    outbox, lane = Outbox(), Lane(1, depth)
    waiting: list[int] = []
    first = dropped = 0
    for lengths, frames in turns:
        for length in lengths:
            outbox.put_lane(lane, make_run(first, [b"\xc0"] * length))
            waiting += range(first, first + length)
            first += length
        for _ in range(frames):
            raw = take_one(outbox)
            left = [] if raw is None else numbers(raw)
            assert left == waiting[: len(left)]
            del waiting[: len(left)]
        outbox.trim()
        dropped += max(0, len(waiting) - depth)
        waiting = waiting[-depth:]
        assert (lane.pending, lane.dropped) == (len(waiting), dropped)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == waiting
    assert lane.sent + lane.dropped == first


def test_the_byte_ceiling_keeps_the_last_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """§11: beyond LANE_BYTES the oldest runs go, whatever the depth, but never the last message."""
    monkeypatch.setattr(limits, "LANE_BYTES", 100)
    lane = Lane(1, 1000)
    for sequence in range(5):
        lane.put(make_run(sequence, [bytes(40)]))
    lane.trim()
    assert (lane.pending, lane.pending_bytes, lane.dropped) == (2, 80, 3)
    lane.put(make_run(5, [bytes(500)]))
    lane.trim()
    assert (lane.pending, lane.pending_bytes, lane.first_sequence) == (1, 500, 5)
    lane.put(make_run(6, [bytes(60)] * 3))
    lane.trim()
    assert (lane.pending, lane.first_sequence) == (1, 8)


def test_keep_all_is_never_trimmed(monkeypatch: pytest.MonkeyPatch) -> None:
    """§6: a lane without depth drops nothing."""
    monkeypatch.setattr(limits, "LANE_BYTES", 100)
    lane = Lane(1, None)
    lane.put(make_run(0, [bytes(60)] * 3))
    lane.trim()
    assert (lane.pending, lane.dropped) == (3, 0)


def test_what_is_sent_again_and_held_up_by_another_break_is_no_loss() -> None:
    """§6.6.3: it goes from the lane and is not counted as dropped; what has never left stays."""
    outbox, lane = Outbox(), Lane(1, 10)
    outbox.put_lane(lane, make_run(0, [b"\xc0"] * 6))
    assert [number for raw in drain(outbox) for number in numbers(raw)] == list(range(6))
    lane.restart(2, 0)
    lane.put_front(make_run(0, [b"\xc0"] * 6))
    lane.put(make_run(6, [b"\xc0"] * 3))
    lane.sequence_limit = 2
    outbox = Outbox()
    outbox.wake(lane)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [0, 1]
    lane.restart(0)
    assert (lane.first_sequence, lane.pending, lane.dropped, lane.abandoned) == (6, 3, 0, 4)
    assert lane.sent + lane.pending + lane.abandoned == 9 + 6


def test_what_is_sent_again_and_gives_way_to_newer_messages_is_no_loss() -> None:
    """§6.4.2: the depth takes it out of the lane, and only what has never left counts as dropped."""
    lane = Lane(1, 4)
    outbox = Outbox()
    outbox.put_lane(lane, make_run(0, [b"\xc0"] * 4))
    drain(outbox)
    lane.restart(2, 0)
    lane.put_front(make_run(0, [b"\xc0"] * 4))
    lane.put(make_run(4, [b"\xc0"] * 6))
    lane.trim()
    assert (lane.first_sequence, lane.dropped, lane.abandoned) == (6, 2, 4)
