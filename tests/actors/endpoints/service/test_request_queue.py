"""Tests of the requests that wait for a handler: in order, and within both limits."""

from __future__ import annotations

from actors.endpoints.service.request_queue import RequestQueue
from proto.wire.frames import RequestEntry


def entry(call: int, size: int = 10) -> RequestEntry:
    """Return a request of this size."""
    return RequestEntry(call, None, None, bytes(size))


def test_the_oldest_comes_first() -> None:
    """Requests leave as they came, but for those taken back; the bytes are those of what waits."""
    queue = RequestQueue()
    for call in (5, 3, 4):
        assert queue.put(entry(call, call)) is None
    assert (len(queue.entries), queue.size) == (3, 12)
    assert queue.remove(3)
    assert not queue.remove(3)
    assert [queue.pop().call, queue.pop().call] == [5, 4]
    assert (len(queue.entries), queue.size) == (0, 0)


def test_one_too_many_is_refused() -> None:
    """The refusal says how many wait; room made is room again."""
    queue = RequestQueue(max_requests=2)
    assert queue.put(entry(1)) is None
    assert queue.put(entry(2)) is None
    assert queue.put(entry(3)) == "2 requests wait already"
    queue.pop()
    assert queue.put(entry(3)) is None


def test_one_too_large_is_refused() -> None:
    """Bytes are bounded, too; alone, a request may be of any size."""
    queue = RequestQueue(max_bytes=100)
    assert queue.put(entry(1, 500)) is None
    assert queue.put(entry(2, 1)) == "requests of 500 bytes wait already"
    queue.clear()
    assert (len(queue.entries), queue.size) == (0, 0)
    assert queue.put(entry(2, 60)) is None
    assert queue.put(entry(3, 40)) is None
    assert queue.put(entry(4, 1)) is not None
