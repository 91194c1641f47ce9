"""Steps at a rate, for what is done again and again."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Pace:
    """Says how long to wait before the next step, without drift.

    What a slow step has lost is not made up for by a burst: one step at most comes at once.

    Args:
        per_sec: Steps a second, above zero.
        clock: Returns the time in seconds, such as a loop's `time`.
    """

    def __init__(self, per_sec: float, clock: Callable[[], float]) -> None:
        self._period_sec = 1 / per_sec
        self._clock = clock
        self._due = clock()

    def wait_sec(self) -> float:
        """Return the seconds until the next step; one has just been made."""
        now = self._clock()
        self._due = max(self._due, now - self._period_sec) + self._period_sec
        return max(0.0, self._due - now)
