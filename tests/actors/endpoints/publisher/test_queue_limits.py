"""Room: KEEP_LAST always has some, KEEP_ALL up to its limits in messages and bytes."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from actors.endpoints.publisher import queue_limits
from proto.queues.publisher_queue import PublisherQueue
from tests.broker.frame_makers import batch
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    import pytest


def test_keep_last_is_never_full_and_is_crowded_at_its_depth() -> None:
    """Then the next message would drop one."""
    queue = PublisherQueue(0, 10)
    assert queue_limits.left(queue, 1_000_000) == sys.maxsize
    assert (queue_limits.crowded(queue, 9), queue_limits.crowded(queue, 10)) == (False, True)
    assert queue_limits.limit(queue) == 10


def test_keep_all_is_crowded_long_before_it_is_full() -> None:
    """In messages: what is left counts down to nothing, and not below."""
    queue = PublisherQueue(0, None)
    assert queue_limits.left(queue, 1) == queue_limits.KEEP_ALL_MESSAGES - 1
    assert queue_limits.left(queue, queue_limits.KEEP_ALL_MESSAGES + 5) == 0
    assert not queue_limits.crowded(queue, queue_limits.READY_MESSAGES - 1)
    assert queue_limits.crowded(queue, queue_limits.READY_MESSAGES)
    assert queue_limits.limit(queue) == queue_limits.KEEP_ALL_MESSAGES


def test_keep_all_is_bounded_in_bytes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """However few messages they are."""
    queue = PublisherQueue(0, None)
    set_limits(monkeypatch, ready_bytes=1000, keep_all_bytes=3000)
    queue.put(batch(1, 0, 1, 2000))
    assert queue_limits.crowded(queue, 1)
    assert queue_limits.left(queue, 1) > 0
    queue.put(batch(1, 1, 1, 2000))
    assert queue_limits.left(queue, 2) == 0
