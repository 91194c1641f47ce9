"""Results of ended goals, kept for clients that ask late. Pure; time is an argument."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.interfaces.action_msgs.msg import GoalInfo

MAX_RESULTS: Final = 1000
"""Results that a server keeps; beyond that the oldest is dropped."""

MAX_RESULT_BYTES: Final = 16 * 1024 * 1024
"""Bytes of encoded results that a server keeps; beyond that the oldest are dropped, but never the newest."""


class KeptResult(NamedTuple):
    """The result of an ended goal."""

    info: GoalInfo
    response: Any
    """The response to get_result requests: status and result."""
    size: int
    """Its encoded size in bytes."""
    expires_at: float


class KeptResults:
    """The results of one server, oldest first.

    Args:
        timeout_sec: Seconds to keep a result; negative for no limit.
        max_results: How many are kept.
        max_bytes: How many bytes of them; the newest is kept, however large.

    Attributes:
        dropped: Results dropped before their time, because there were too many.
    """

    def __init__(
        self, timeout_sec: float, *, max_results: int = MAX_RESULTS, max_bytes: int = MAX_RESULT_BYTES
    ) -> None:
        self._max_results, self._max_bytes = max_results, max_bytes
        self.dropped = 0
        self._timeout_sec = timeout_sec if timeout_sec >= 0 else math.inf
        self._results: dict[bytes, KeptResult] = {}
        self._size = 0

    def __iter__(self) -> Iterator[KeptResult]:
        return iter(self._results.values())

    def __len__(self) -> int:
        return len(self._results)

    def get(self, goal_id: bytes) -> KeptResult | None:
        """Return the result of a goal, if it is kept."""
        return self._results.get(goal_id)

    def add(self, goal_id: bytes, info: GoalInfo, response: Any, *, size: int, now: float) -> None:
        """Keep a result; drop the oldest beyond the limits."""
        # All have the same time limit, so that the order of insertion is the order of expiry.
        self._results[goal_id] = KeptResult(info, response, size, now + self._timeout_sec)
        self._size += size
        # Never the newest: the clients that wait for it are about to be answered, and one may ask again.
        while len(self._results) > self._max_results or (self._size > self._max_bytes and len(self) > 1):
            self._drop_oldest()
            self.dropped += 1

    @property
    def next_expiry(self) -> float:
        """The loop time at which the oldest result expires; infinity if none does."""
        return next((each.expires_at for each in self), math.inf)

    def expire(self, now: float) -> None:
        """Drop the results whose time has passed."""
        while self.next_expiry <= now:
            self._drop_oldest()

    def _drop_oldest(self) -> None:
        self._size -= self._results.pop(next(iter(self._results))).size
