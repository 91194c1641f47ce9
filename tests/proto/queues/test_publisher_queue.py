"""Publisher queues: depth in messages whatever the batches, limits in bytes, and complete counts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.queues.outbox import Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import decode, encode
from proto.wire.frames import Batch, Detached
from tests.proto.outboxes import drain, make_batch, take_one

if TYPE_CHECKING:
    import pytest


def numbers(raw: bytes) -> list[int]:
    """Return the sequence numbers of the messages of a batch."""
    batch = decode(raw)
    assert isinstance(batch, Batch)
    return list(range(batch.first_sequence, batch.first_sequence + batch.length))


@given(
    depth=st.integers(1, 12),
    turns=st.lists(st.tuples(st.lists(st.integers(1, 9), max_size=4), st.integers(0, 3)), max_size=20),
)
def test_a_full_link_keeps_exactly_the_newest_messages(
    depth: int, turns: list[tuple[list[int], int]]
) -> None:
    """§6.4.1: batches are queued and frames sent in turns; of the unsent messages, `depth` stay."""
    outbox, queue = Outbox(), PublisherQueue(1, depth)
    waiting: list[int] = []
    first = dropped = 0
    for lengths, frames in turns:
        for length in lengths:
            outbox.enqueue(queue, make_batch(first, [b"\xc0"] * length))
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
        assert (queue.pending, queue.dropped) == (len(waiting), dropped)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == waiting
    assert queue.sent + queue.dropped == first


def test_the_end_is_behind_what_waits_and_what_was_sent() -> None:
    """Before the first message it is 0."""
    outbox, queue = Outbox(), PublisherQueue(1, 10)
    assert queue.end_sequence == 0
    outbox.enqueue(queue, make_batch(5, [b"x"] * 3))
    assert queue.end_sequence == 8
    drain(outbox)
    assert queue.end_sequence == 8


def test_a_batch_that_was_never_queued_can_be_lost() -> None:
    """It counts beside those that wait, which go on waiting."""
    outbox, queue = Outbox(), PublisherQueue(1, 10)
    outbox.enqueue(queue, make_batch(0, [b"x"] * 2))
    queue.mark_lost(make_batch(2, [b"x"] * 3))
    assert (queue.lost_on_break, queue.pending) == (3, 2)
    queue.mark_lost()
    assert (queue.lost_on_break, queue.pending) == (5, 0)


def test_the_byte_limit_keeps_the_last_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """§11: beyond MAX_QUEUE_BYTES the oldest batches are dropped, but never the last message."""
    monkeypatch.setattr(limits, "MAX_QUEUE_BYTES", 100)
    queue = PublisherQueue(1, 1000)
    for sequence in range(5):
        queue.put(make_batch(sequence, [bytes(40)]))
    queue.trim()
    assert (queue.pending, queue.pending_bytes, queue.dropped) == (2, 80, 3)
    queue.put(make_batch(5, [bytes(500)]))
    queue.trim()
    assert (queue.pending, queue.pending_bytes, queue.first_sequence) == (1, 500, 5)
    queue.put(make_batch(6, [bytes(60)] * 3))
    queue.trim()
    assert (queue.pending, queue.first_sequence) == (1, 8)


def test_exactly_the_byte_limit_may_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what exceeds it is dropped."""
    monkeypatch.setattr(limits, "MAX_QUEUE_BYTES", 100)
    queue = PublisherQueue(1, 2)
    for sequence in range(3):  # one is dropped for the depth
        queue.put(make_batch(sequence, [bytes(50)]))
    queue.trim()
    assert (queue.pending_bytes, queue.dropped) == (100, 1)


def test_keep_all_is_never_trimmed(monkeypatch: pytest.MonkeyPatch) -> None:
    """§6: a queue without a depth drops nothing."""
    monkeypatch.setattr(limits, "MAX_QUEUE_BYTES", 100)
    queue = PublisherQueue(1, None)
    queue.put(make_batch(0, [bytes(60)] * 3))
    queue.trim()
    assert (queue.pending, queue.dropped) == (3, 0)


def test_resent_messages_that_wait_at_another_break_are_not_dropped() -> None:
    """§6.6.3: they are removed as abandoned; messages that were never sent stay."""
    outbox, queue = Outbox(), PublisherQueue(1, 10)
    outbox.enqueue(queue, make_batch(0, [b"\xc0"] * 6))
    assert [number for raw in drain(outbox) for number in numbers(raw)] == list(range(6))
    queue.restart(2, 0)
    queue.put_front(make_batch(0, [b"\xc0"] * 6))
    queue.put(make_batch(6, [b"\xc0"] * 3))
    queue.sequence_limit = 2
    outbox = Outbox()
    outbox.schedule(queue)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [0, 1]
    queue.restart(0)
    assert (queue.first_sequence, queue.pending, queue.dropped, queue.abandoned) == (6, 3, 0, 4)
    assert queue.sent + queue.pending + queue.abandoned == 9 + 6


def test_resent_messages_beyond_the_depth_are_not_dropped() -> None:
    """§6.4.2: the depth removes them, and only messages that were never sent count as dropped."""
    queue = PublisherQueue(1, 4)
    outbox = Outbox()
    outbox.enqueue(queue, make_batch(0, [b"\xc0"] * 4))
    drain(outbox)
    queue.restart(2, 0)
    queue.put_front(make_batch(0, [b"\xc0"] * 4))
    queue.put(make_batch(4, [b"\xc0"] * 6))
    queue.trim()
    assert (queue.first_sequence, queue.dropped, queue.abandoned) == (6, 2, 4)


def test_a_restart_removes_control_frames() -> None:
    """They carry ids of the old link; the messages before and behind them stay, in order."""
    queue, outbox = PublisherQueue(1, None), Outbox()
    queue.put(make_batch(0, [b"\xc0"]))
    queue.put(encode(Detached(1, (2,), 0)))
    queue.put(make_batch(1, [b"\xc0"]))
    queue.restart(9)
    assert queue.control_bytes == 0
    outbox.schedule(queue)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [0, 1]


def test_credit_cuts_a_batch_by_its_numbers() -> None:
    """The limit is the number of the first message that may not be sent, wherever the batch begins."""
    queue, outbox = PublisherQueue(1, None), Outbox()
    queue.put(make_batch(5, [b"\xc0"] * 5))
    queue.sequence_limit = 7
    outbox.schedule(queue)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [5, 6]
    assert (queue.pending, queue.sent) == (3, 2)


def test_credit_in_bytes_that_is_used_up_allows_nothing_more() -> None:
    """One message may exceed it, but not a further one, not even when it was used up exactly."""
    queue, outbox = PublisherQueue(1, None), Outbox()
    queue.byte_limit = 50
    for sequence in range(3):
        queue.put(make_batch(sequence, [bytes(50)]))
    outbox.schedule(queue)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [0]
    queue.byte_limit = 51
    outbox.schedule(queue)
    assert [number for raw in drain(outbox) for number in numbers(raw)] == [1]
