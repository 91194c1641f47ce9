"""Repetition at a rate."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class RateLimit:
    """Waits between steps to keep a rate, without drift.

    A slow step is not followed by a burst: at most one step follows at once.

    Args:
        per_sec: Steps per second, above zero; None for no limit.
        clock: Returns the time in seconds; None for the running loop's.
    """

    def __init__(self, per_sec: float | None, clock: Callable[[], float] | None = None) -> None:
        self._period_sec = 1 / per_sec if per_sec else 0.0
        self._clock = clock or asyncio.get_running_loop().time
        self._due = self._clock()

    def wait_sec(self) -> float:
        """Return the seconds until the next step; call it after a step."""
        now = self._clock()
        self._due = max(self._due, now - self._period_sec) + self._period_sec
        return max(0.0, self._due - now)

    async def wait(self) -> None:
        """Wait until the next step is due; call it after a step."""
        if self._period_sec:
            await asyncio.sleep(self.wait_sec())
