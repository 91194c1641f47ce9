"""How many messages may wait in a publisher queue.

KEEP_LAST always has space: beyond its depth the oldest messages are dropped. KEEP_ALL drops nothing and may
become full; long before that it is crowded, and `ready` waits.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from proto.queues.publisher_queue import PublisherQueue

KEEP_ALL_MESSAGES: Final = 100_000
KEEP_ALL_BYTES: Final = 64 * 1024 * 1024
"""Limits of a KEEP_ALL publisher's queue; beyond them `publish` raises PublisherFull."""

READY_MESSAGES: Final = 10_000
READY_BYTES: Final = 4 * 1024 * 1024
"""Above this a KEEP_ALL publisher's `ready` waits, long before `publish` would raise."""


def limit(queue: PublisherQueue) -> int:
    """Return how many messages may wait."""
    return KEEP_ALL_MESSAGES if queue.depth is None else queue.depth


def left(queue: PublisherQueue, queued: int) -> int:
    """Return how many messages may be published before the next check; 0 if the queue is full.

    Args:
        queue: The publisher's; without a depth it is KEEP_ALL.
        queued: Messages that wait, in the queue and before it.
    """
    if queue.depth is not None:
        return sys.maxsize
    return max(0, KEEP_ALL_MESSAGES - queued) if queue.pending_bytes < KEEP_ALL_BYTES else 0


def crowded(queue: PublisherQueue, queued: int) -> bool:
    """Return whether publishing would drop a message, or should wait for readers; arguments as for `left`."""
    if queue.depth is not None:
        return queued >= queue.depth
    return queued >= READY_MESSAGES or queue.pending_bytes >= READY_BYTES
