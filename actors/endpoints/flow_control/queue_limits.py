"""Room: what may wait in a publisher's queue.

KEEP_LAST has room for ever: beyond its depth the oldest go. KEEP_ALL drops nothing, so it is full at last;
long before that it is crowded, and whoever awaits `ready` waits.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from proto.publisher_queue import PublisherQueue

KEEP_ALL_MESSAGES: Final = 100_000
KEEP_ALL_BYTES: Final = 64 * 1024 * 1024
"""What a KEEP_ALL publisher queues while its readers are slow, before `publish` raises PublisherFull."""

READY_MESSAGES: Final = 10_000
READY_BYTES: Final = 4 * 1024 * 1024
"""Above this a KEEP_ALL publisher's `ready` waits, long before `publish` would raise."""


def limit(queue: PublisherQueue) -> int:
    """Return how many messages may wait."""
    return KEEP_ALL_MESSAGES if queue.depth is None else queue.depth


def left(queue: PublisherQueue, queued: int) -> int:
    """Return how many messages may be published before somebody must look again; 0 if it is full.

    Args:
        queue: The publisher's; one without a depth is KEEP_ALL's.
        queued: Messages that wait, in the lane and before it.
    """
    if queue.depth is not None:
        return sys.maxsize
    return max(0, KEEP_ALL_MESSAGES - queued) if queue.pending_bytes < KEEP_ALL_BYTES else 0


def crowded(queue: PublisherQueue, queued: int) -> bool:
    """Tell whether to publish would drop something, or should wait for readers; arguments as for `left`."""
    if queue.depth is not None:
        return queued >= queue.depth
    return queued >= READY_MESSAGES or queue.pending_bytes >= READY_BYTES
