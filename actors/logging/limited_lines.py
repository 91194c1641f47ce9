"""Log lines that others can cause in any number, on an event loop: a few of each reason, then sums."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from proto.limited_log import PERIOD_SEC, LimitedLog

if TYPE_CHECKING:
    from collections.abc import Callable


class LimitedLines:
    """Decides which lines are logged, and logs how many were not, also after the last of them.

    Everything is called on the event loop.

    Args:
        write: Logs a line.
        period_sec: The time between sums.
    """

    def __init__(self, write: Callable[[str], object], *, period_sec: float = PERIOD_SEC) -> None:
        self._write = write
        self._period_sec = period_sec
        self._log = LimitedLog(
            self._write_sum, lambda: asyncio.get_running_loop().time(), period_sec=period_sec
        )
        self._due: asyncio.TimerHandle | None = None

    def admits(self, reason: str) -> bool:
        """Return whether to log a line now; count it if not.

        Args:
            reason: The kind of line, as the line with the count names it.
        """
        admitted = self._log.admits(reason)
        self._schedule()
        return admitted

    def close(self) -> None:
        """Log how many lines were not logged."""
        self._log.report_omitted(at_once=True)
        if self._due is not None:
            self._due.cancel()
            self._due = None

    def _schedule(self) -> None:
        if self._log.omitting and self._due is None:
            self._due = asyncio.get_running_loop().call_later(self._period_sec, self._report)

    def _report(self) -> None:
        self._due = None
        self._log.report_omitted()
        self._schedule()

    def _write_sum(self, omitted: int, reason: str) -> None:
        self._write(f"… and {omitted} more like this: {reason}")
