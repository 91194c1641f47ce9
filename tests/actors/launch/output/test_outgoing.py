"""What waits for a thread: bounded, in order, and counted when it is dropped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch.output import outgoing
from actors.launch.output.outgoing import Batch, Outgoing

if TYPE_CHECKING:
    import pytest


def test_pieces_are_taken_in_batches() -> None:
    """As much as a batch holds, in order; then the end, and that again."""
    waiting: Outgoing[int] = Outgoing()
    for number in range(3):
        waiting.add(number, outgoing.BATCH_BYTES // 2, 1)
    waiting.end()
    assert waiting.take() == Batch((0, 1))
    assert waiting.take() == Batch((2,))
    assert waiting.take() == waiting.take() == Batch(last=True)


def test_what_is_too_much_is_reported_when_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, behind what waits."""
    monkeypatch.setattr(outgoing, "MAX_WAITING_BYTES", 10)
    waiting: Outgoing[str] = Outgoing()
    waiting.add("a", 10, 1)
    waiting.add("b", 1, 3)
    assert waiting.take() == Batch(("a",))
    waiting.add("c", 10, 1)
    assert waiting.take() == Batch(("c",))
    assert waiting.take() == Batch(lost_lines=3)
    waiting.wake()
    assert waiting.take() == Batch()
    assert waiting.lost_lines == 3


def test_nothing_is_kept_that_cannot_be_written() -> None:
    """What waits is lost with what comes later; and so is what comes after the end."""
    waiting: Outgoing[str] = Outgoing()
    waiting.add("a", 1, 2)
    waiting.abandon()
    waiting.add("b", 1, 3)
    assert waiting.lost_lines == 5
    other: Outgoing[str] = Outgoing()
    other.end()
    other.add("c", 1, 1)
    assert other.lost_lines == 1
