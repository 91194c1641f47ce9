"""Messages that wait for the disk, and the time when they must be written. Pure: time is an argument.

A queued message is a tuple because nothing is created faster: a recorder queues up to a hundred thousand a
second.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.bags.recorder.recorded_topic import RecordedTopic

FLUSH_SEC: Final = 0.4
"""Longest time for a message in a file's open chunk, so that messages older than 0.5 s survive a kill."""

OVERHEAD_BYTES: Final = 300
"""Memory for a queued message besides its data: the tuple, the bytes object, and its numbers."""


class QueuedMessage(NamedTuple):
    """A message on its way to the bag."""

    log_time_ns: int
    """Time of reception."""
    topic: RecordedTopic
    data: bytes
    """The message as msgpack."""
    publish_time_ns: int
    sequence: int
    gid: bytes
    """Identifies the publisher."""


class FlushPlan:
    """Decides when to close and write the open chunk of a file.

    Args:
        interval_sec: Longest time for which a message may wait in the chunk.
    """

    __slots__ = ("_interval_sec", "_since")

    def __init__(self, interval_sec: float = FLUSH_SEC) -> None:
        self._interval_sec = interval_sec
        self._since: float | None = None

    def note(self, now: float) -> None:
        """Note that a message has been written into the open chunk."""
        if self._since is None:
            self._since = now

    def wait_sec(self, now: float) -> float | None:
        """Return the seconds until the next flush, 0 if it is due; None if no message waits for it."""
        return None if self._since is None else max(0.0, self._since + self._interval_sec - now)

    def is_due(self, now: float) -> bool:
        """Return whether to flush now."""
        return self._since is not None and now >= self._since + self._interval_sec

    def flushed(self) -> None:
        """Note that everything has been written."""
        self._since = None


class SnapshotRing:
    """Keeps the newest messages in memory for a snapshot, and drops older ones.

    Args:
        max_bytes: Limit for the memory of all messages. The newest message is kept whatever its size.
    """

    __slots__ = ("_max_bytes", "_messages", "size")

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._messages: deque[QueuedMessage] = deque()
        self.size = 0

    def add(self, messages: Sequence[QueuedMessage], size: int) -> None:
        """Add messages, and drop the oldest ones beyond the limit.

        Args:
            messages: The messages.
            size: Their memory in bytes, including `OVERHEAD_BYTES` for each.
        """
        self._messages.extend(messages)
        self.size += size
        while self.size > self._max_bytes and len(self._messages) > 1:
            self.size -= len(self._messages.popleft().data) + OVERHEAD_BYTES

    def pop_all(self) -> list[QueuedMessage]:
        """Remove all messages, and return them, oldest first."""
        found = list(self._messages)
        self._messages.clear()
        self.size = 0
        return found
