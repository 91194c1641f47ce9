"""What waits for the disk, and when it has to be there. Pure: time is an argument.

A message in the queue is a tuple, which is made fastest: a recorder makes a hundred thousand a second.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.bags.recorder.recorded_topic import RecordedTopic

FLUSH_SEC: Final = 0.4
"""Longest time for which a message waits in a file's open chunk: after half a second it survives a kill."""

OVERHEAD_BYTES: Final = 300
"""What a message in the queue takes besides its own bytes: its tuple, its object, its numbers."""


class QueuedMessage(NamedTuple):
    """A message on its way to the bag."""

    log_time_ns: int
    """When it was received."""
    topic: RecordedTopic
    data: bytes
    """As msgpack."""
    publish_time_ns: int
    sequence: int
    gid: bytes
    """Its publisher."""


class FlushPlan:
    """Says when the open chunk of a file has to be closed and written.

    Args:
        interval_sec: Longest time from a message to that.
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
        """Return the seconds until the next flush, 0 if it is due; None while nothing waits for it."""
        return None if self._since is None else max(0.0, self._since + self._interval_sec - now)

    def is_due(self, now: float) -> bool:
        """Return whether to flush now."""
        return self._since is not None and now >= self._since + self._interval_sec

    def flushed(self) -> None:
        """Note that everything has been written."""
        self._since = None


class SnapshotRing:
    """The newest messages, as long as nobody asks for them; older ones are forgotten.

    Args:
        max_bytes: What they may take in memory. One message is kept, whatever its size.
    """

    __slots__ = ("_max_bytes", "_messages", "size")

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._messages: deque[QueuedMessage] = deque()
        self.size = 0

    def add(self, messages: Sequence[QueuedMessage], size: int) -> None:
        """Add messages, and forget the oldest ones.

        Args:
            messages: The messages.
            size: What they take in memory, with `OVERHEAD_BYTES` for each.
        """
        self._messages.extend(messages)
        self.size += size
        while self.size > self._max_bytes and len(self._messages) > 1:
            self.size -= len(self._messages.popleft().data) + OVERHEAD_BYTES

    def take(self) -> list[QueuedMessage]:
        """Return all messages, oldest first, and forget them."""
        found = list(self._messages)
        self._messages.clear()
        self.size = 0
        return found
