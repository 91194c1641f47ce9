"""The last messages of a latched publisher, kept for a broker that restarts."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.queues.batches import message_bytes, slice_batch

if TYPE_CHECKING:
    from collections.abc import Iterator

    from proto.wire.frames import Batch

RETAINED_BYTES: Final = limits.MAX_QUEUE_BYTES
"""Bytes that one publisher keeps at most, whatever its depth. The last message is always kept."""


class Retained:
    """The last messages of one publisher, in batches, oldest first.

    Args:
        keep: How many messages at most.
        max_bytes: How many bytes; the last message is kept, however large.

    Attributes:
        messages: How many there are.
        size: Their bytes.
    """

    __slots__ = ("_batches", "_keep", "_max_bytes", "messages", "size")

    def __init__(self, keep: int, max_bytes: int = RETAINED_BYTES) -> None:
        self._max_bytes = max_bytes
        self.messages = self.size = 0
        self._keep = keep
        self._batches: deque[Batch] = deque()

    @property
    def first_sequence(self) -> int | None:
        """The number of the oldest message; None without any."""
        return self._batches[0].first_sequence if self._batches else None

    def newest_first(self, *, before: int | None = None) -> Iterator[Batch]:
        """Iterate over the batches, the newest first; with `before` only over messages below that number."""
        for batch in reversed(self._batches):
            if before is None or batch.first_sequence + batch.length <= before:
                yield batch
            elif batch.first_sequence < before:
                yield slice_batch(batch, 0, before - batch.first_sequence)

    def add(self, batch: Batch) -> None:
        """Add a published batch."""
        self._batches.append(batch)
        self.messages += batch.length
        self.size += message_bytes(batch)
        while self.messages > self._keep or (self.size > self._max_bytes and self.messages > 1):
            oldest = self._batches.popleft()
            excess = min(oldest.length, max(self.messages - self._keep, 1))
            self.messages -= excess
            self.size -= message_bytes(oldest)
            if excess < oldest.length:
                rest = slice_batch(oldest, excess, oldest.length)
                self.size += message_bytes(rest)
                self._batches.appendleft(rest)

    def drop_larger(self, most: int) -> None:
        """Remove batches with more than `most` bytes of messages."""
        kept = [batch for batch in self._batches if message_bytes(batch) <= most]
        self._batches.clear()
        self.messages = self.size = 0
        for batch in kept:
            self.add(batch)
