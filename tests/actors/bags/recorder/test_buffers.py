"""Messages that wait for the disk, and when they must be written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from actors.bags.recorder.buffers import FLUSH_SEC, OVERHEAD_BYTES, FlushPlan, QueuedMessage, SnapshotRing

if TYPE_CHECKING:
    from actors.bags.recorder.recorded_topic import RecordedTopic


def message(number: int, size: int = 0) -> QueuedMessage:
    """Return a message."""
    return QueuedMessage(number, cast("RecordedTopic", None), bytes(size), number, number, b"")


def test_a_chunk_is_due_after_its_first_message() -> None:
    """Further messages do not postpone a flush; without messages none is due."""
    plan = FlushPlan(1.0)
    assert plan.wait_sec(0.0) is None
    assert not plan.is_due(100.0)
    plan.note(100.0)
    plan.note(100.9)
    assert plan.wait_sec(100.25) == 0.75
    assert not plan.is_due(100.9)
    assert plan.is_due(101.0)
    assert plan.wait_sec(102.0) == 0.0
    plan.flushed()
    assert plan.wait_sec(102.0) is None
    plan.note(105.0)
    assert plan.wait_sec(105.0) == 1.0


def test_messages_wait_for_less_than_half_a_second() -> None:
    """Messages older than half a second survive a kill."""
    assert FLUSH_SEC < 0.5


def test_a_ring_keeps_the_newest() -> None:
    """Older messages are dropped beyond the limit; `pop_all` empties the ring."""
    ring = SnapshotRing(3 * OVERHEAD_BYTES)
    for number in range(5):
        ring.add([message(number)], OVERHEAD_BYTES)
    assert ring.size == 3 * OVERHEAD_BYTES
    assert [each.sequence for each in ring.pop_all()] == [2, 3, 4]
    assert (ring.size, ring.pop_all()) == (0, [])


def test_a_ring_keeps_one_message_of_any_size() -> None:
    """A message larger than the limit is kept: a snapshot of a large image is better than an empty one."""
    ring = SnapshotRing(10)
    ring.add([message(1, 50), message(2, 50)], 2 * (50 + OVERHEAD_BYTES))
    taken: list[Any] = ring.pop_all()
    assert [each.sequence for each in taken] == [2]
