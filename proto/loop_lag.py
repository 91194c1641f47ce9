"""The lag of an event loop: how late it runs timers because other work blocks it.

The lag is measured with timers that exist for other reasons; none is started for this.
"""

from __future__ import annotations

from typing import Final

_BUCKET_SEC: Final = 10.0
_BUCKETS: Final = 7
"""Six complete buckets and the current one cover the last minute."""


class LoopLag:
    """The lag of one event loop, measured by one node or broker.

    Attributes:
        last_sec: The delay of the last timer.
    """

    def __init__(self) -> None:
        self.last_sec = 0.0
        self._buckets: list[tuple[int, float]] = []
        """The last `_BUCKETS` buckets: each one's number, and the longest delay in it."""

    def record(self, now: float, late_sec: float) -> None:
        """Record that a timer ran `late_sec` seconds late."""
        self.last_sec = late_sec
        number = int(now // _BUCKET_SEC)
        if self._buckets and self._buckets[-1][0] == number:
            late_sec = max(late_sec, self._buckets.pop()[1])
        self._buckets.append((number, late_sec))
        del self._buckets[:-_BUCKETS]

    def longest_sec(self, now: float) -> float:
        """Return the longest delay of the last minute, to ten seconds; 0 without one."""
        oldest = int(now // _BUCKET_SEC) - _BUCKETS + 1
        return max((late for number, late in self._buckets if number >= oldest), default=0.0)
