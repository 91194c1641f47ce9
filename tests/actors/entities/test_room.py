"""Room: KEEP_LAST always has some, KEEP_ALL up to its limits in messages and bytes."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from actors.entities import room
from proto.lane import Lane
from tests.broker.frame_makers import run

if TYPE_CHECKING:
    import pytest


def test_keep_last_is_never_full_and_is_crowded_at_its_depth() -> None:
    """Then the next message would drop one."""
    lane = Lane(0, 10)
    assert room.left(lane, 1_000_000) == sys.maxsize
    assert (room.crowded(lane, 9), room.crowded(lane, 10)) == (False, True)
    assert room.limit(lane) == 10


def test_keep_all_is_crowded_long_before_it_is_full() -> None:
    """In messages: what is left counts down to nothing, and not below."""
    lane = Lane(0, None)
    assert room.left(lane, 1) == room.KEEP_ALL_MESSAGES - 1
    assert room.left(lane, room.KEEP_ALL_MESSAGES + 5) == 0
    assert not room.crowded(lane, room.READY_MESSAGES - 1)
    assert room.crowded(lane, room.READY_MESSAGES)
    assert room.limit(lane) == room.KEEP_ALL_MESSAGES


def test_keep_all_is_bounded_in_bytes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """However few messages they are."""
    lane = Lane(0, None)
    monkeypatch.setattr(room, "READY_BYTES", 1000)
    monkeypatch.setattr(room, "KEEP_ALL_BYTES", 3000)
    lane.put(run(1, 0, 1, 2000))
    assert room.crowded(lane, 1)
    assert room.left(lane, 1) > 0
    lane.put(run(1, 1, 1, 2000))
    assert room.left(lane, 2) == 0
