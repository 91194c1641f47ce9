"""How late the event loop comes to what is due: what everything waits because of something else.

Whoever has a timer anyway says how late it rang; nothing is timed for this alone.
"""

from __future__ import annotations

from collections import deque
from typing import Final

_BUCKET_SEC: Final = 10.0
_BUCKETS: Final = 7
"""Six whole buckets and the one being filled: the last minute, to ten seconds."""


class LoopLag:
    """One loop's, as one node or one broker sees it. Pure: time is an argument.

    Attributes:
        last_sec: How late the last timer was.
    """

    def __init__(self) -> None:
        self.last_sec = 0.0
        self._buckets: deque[tuple[int, float]] = deque(maxlen=_BUCKETS)
        """The longest delay of each bucket of time that had one."""

    def record(self, now: float, late_sec: float) -> None:
        """A timer has rung so late."""
        self.last_sec = late_sec
        number = int(now // _BUCKET_SEC)
        if self._buckets and self._buckets[-1][0] == number:
            late_sec = max(late_sec, self._buckets.pop()[1])
        self._buckets.append((number, late_sec))

    def longest_sec(self, now: float) -> float:
        """Return the longest delay of the last minute (to ten seconds); 0 without any."""
        oldest = int(now // _BUCKET_SEC) - _BUCKETS + 1
        return max((late for number, late in self._buckets if number >= oldest), default=0.0)
