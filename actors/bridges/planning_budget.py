"""How much of its time a bridge spends on reading graphs and planning. Pure.

The cost of both grows with the graphs: 0.2 s of CPU time at the limits of a bridge. A client that changes the
graph all the time would cause one plan after the other. So each one is followed by a pause of several times
its cost, in which messages have the loop.
"""

from __future__ import annotations

from typing import Final

SHARE: Final = 0.2
"""Part of the time for reading and planning while graphs change all the time."""

MOST_PAUSE_SEC: Final = 1.0
"""Longest pause, also for a larger graph or a slower machine: an end should be seen soon."""


class PlanningBudget:
    """The budget of one bridge. Times are monotonic, in seconds."""

    def __init__(self) -> None:
        self._free_at = 0.0

    def spend(self, now: float, seconds: float) -> None:
        """Note work.

        Args:
            now: When it has ended.
            seconds: CPU time that it has taken.
        """
        free_at = max(self._free_at, now - seconds) + seconds / SHARE
        self._free_at = min(free_at, now + MOST_PAUSE_SEC)

    def pause(self, now: float) -> float:
        """Return in how many seconds work may go on; 0 for at once.

        Args:
            now: The time.
        """
        return max(0.0, self._free_at - now)
