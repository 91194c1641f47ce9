"""The backlog: what waits is the newest, in order, and what went is counted."""

from __future__ import annotations

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from actors.endpoints.subscription.backlog import Backlog, QueuedBatch
from actors.session.attachments import Attachment
from proto.wire.frames import Attached, Batch


class Nobody:
    """A reader that is not looked at."""


FLOW = Attachment(Nobody(), Attached(1, (1,), b"g" * 16, 0, "/talker", {}))  # type: ignore[arg-type]


def queued_batch_of(numbers: range) -> QueuedBatch:
    """Return a batch whose messages are their own numbers; its end is the number after them."""
    batch = Batch(1, numbers.start, 1, len(numbers), None, None, b"", b"")
    queued_batch = QueuedBatch(FLOW, batch, list(numbers), numbers, 2)
    queued_batch.end = numbers.stop
    return queued_batch


def taken(backlog: Backlog, count: int) -> list[int]:
    """Take so many messages, and look at what belongs to each."""
    found = []
    for _ in range(count):
        queued_batch = backlog.batches[0]
        found.append(backlog.pop())
        assert queued_batch.info().publication_sequence_number == found[-1]
    return found


STEPS = st.one_of(
    st.tuples(st.just("put"), st.integers(1, 12)),
    st.tuples(st.just("take"), st.integers(1, 12)),
    st.tuples(st.just("trim"), st.integers(0, 12)),
    st.tuples(st.just("expire"), st.integers(0, 40)),
)


@given(steps=st.lists(STEPS, max_size=40))
def test_whatever_comes_and_goes_the_newest_stay(steps: list[tuple[str, int]]) -> None:
    """All that goes goes from the front; each message goes one way, each batch ends once."""
    ended: list[QueuedBatch] = []
    backlog, model = Backlog(ended.append), deque[int]()
    expiry: dict[int, int] = {}
    put: list[QueuedBatch] = []
    came = went = 0
    for age, (step, size) in enumerate(steps):
        if step == "put":
            queued_batch = queued_batch_of(range(came, came + size))
            queued_batch.expires_at = age
            expiry.update(dict.fromkeys(range(came, came + size), age))
            model.extend(range(came, came + size))
            came += size
            put.append(queued_batch)
            backlog.put(queued_batch)
        elif step == "take":
            some = min(size, len(model))
            assert taken(backlog, some) == popped(model, some)
            went += some
        elif step == "trim":
            gone = max(0, len(model) - size)
            popped(model, gone)
            went += gone
            assert backlog.trim(size) == gone
        else:
            gone = sum(1 for number in model if expiry[number] <= size)
            popped(model, gone)
            went += gone
            assert backlog.expire(size) == gone
        assert backlog.pending == len(model) == came - went
        waiting = [
            message
            for queued_batch in backlog.batches
            for message in queued_batch.messages[queued_batch.index :]
        ]
        assert waiting == list(model)
        assert all(queued_batch.index < len(queued_batch.messages) for queued_batch in backlog.batches)
    assert [queued_batch for queued_batch in put if queued_batch in ended] == ended  # in order, each once


def popped(model: deque[int], size: int) -> list[int]:
    """Take so many from the front."""
    return [model.popleft() for _ in range(size)]


def test_a_batch_ends_as_its_last_message_is_taken() -> None:
    """Whoever is told gets each batch that was taken to its end, and none that was dropped."""
    ended: list[int] = []
    backlog = Backlog(lambda queued_batch: ended.append(queued_batch.end))
    for start in (0, 3, 6):
        backlog.put(queued_batch_of(range(start, start + 3)))
    assert taken(backlog, 2) == [0, 1]
    assert ended == []
    assert taken(backlog, 1) == [2]
    assert ended == [3]
    assert backlog.trim(2) == 4
    assert taken(backlog, 2) == [7, 8]
    assert ended == [3, 9]
    backlog.put(queued_batch_of(range(9, 10)))
    backlog.clear()
    assert (backlog.pending, list(backlog.batches), ended) == (0, [], [3, 9])
