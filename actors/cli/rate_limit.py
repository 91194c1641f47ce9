"""Repetition at a rate."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class RateLimit:
    """Waits between steps so that they come at a rate, without drift.

    What a slow step has lost is not made up for by a burst: one step at most follows at once.

    Args:
        per_sec: Steps a second, above zero; None for no limit.
        clock: Returns the time in seconds; None takes the running loop's.
    """

    def __init__(self, per_sec: float | None, clock: Callable[[], float] | None = None) -> None:
        self._period_sec = 1 / per_sec if per_sec else 0.0
        self._clock = clock or asyncio.get_running_loop().time
        self._due = self._clock()

    def wait_sec(self) -> float:
        """Return the seconds until the next step; one has just been made."""
        now = self._clock()
        self._due = max(self._due, now - self._period_sec) + self._period_sec
        return max(0.0, self._due - now)

    async def wait(self) -> None:
        """Wait until the next step is due; one has just been made."""
        if self._period_sec:
            await asyncio.sleep(self.wait_sec())
