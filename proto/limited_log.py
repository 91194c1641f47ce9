"""Log lines that peers can cause in any number: a few of each reason, then sums.

Pure: the clock and the output are arguments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_LINES: Final = 10
PERIOD_SEC: Final = 10.0
"""MAX_LINES lines of one reason are logged; then one sum per period, until a period has no such line."""

MAX_REASONS: Final = 100
"""Reasons that are told apart; the lines of further ones are counted together."""

OTHER_REASONS: Final = "other reasons"


class _Reason:
    """The lines of one reason in its current period."""

    __slots__ = ("began", "lines", "omitted")

    def __init__(self, began: float) -> None:
        self.began = began
        self.lines = 0
        self.omitted = 0


class LimitedLog:
    """Decides which lines are logged, and logs how many were not.

    Args:
        write: Logs a sum: how many lines were omitted, and their reason.
        clock: Returns the time in seconds.
        max_lines: Lines of one reason before only sums are logged.
        period_sec: The time between sums.
    """

    def __init__(
        self,
        write: Callable[[int, str], object],
        clock: Callable[[], float],
        *,
        max_lines: int = MAX_LINES,
        period_sec: float = PERIOD_SEC,
    ) -> None:
        self._write = write
        self._clock = clock
        self._max_lines = max_lines
        self._period_sec = period_sec
        self._reasons: dict[str, _Reason] = {}
        self._omitting: dict[str, _Reason] = {}
        """Those with omitted lines."""

    @property
    def omitting(self) -> bool:
        """Whether lines were omitted that no sum has counted yet."""
        return bool(self._omitting)

    def admits(self, reason: str) -> bool:
        """Return whether to log a line now; count it if not.

        Args:
            reason: The kind of line, as the line with the count names it.
        """
        self.report_omitted()
        now = self._clock()
        state = self._find(reason, now)
        if not state.omitted and now - state.began >= self._period_sec:
            state.began, state.lines = now, 0
        if state.lines < self._max_lines:
            state.lines += 1
            return True
        state.omitted += 1
        self._omitting[reason if reason in self._reasons else OTHER_REASONS] = state
        return False

    def _find(self, reason: str, now: float) -> _Reason:
        state = self._reasons.get(reason)
        if state is None:
            if len(self._reasons) >= MAX_REASONS:
                self._forget_quiet(now)
            if len(self._reasons) >= MAX_REASONS:
                reason = OTHER_REASONS
            state = self._reasons.setdefault(reason, _Reason(now))
        return state

    def _forget_quiet(self, now: float) -> None:
        for reason, state in tuple(self._reasons.items()):
            if not state.omitted and now - state.began >= self._period_sec:
                del self._reasons[reason]

    def report_omitted(self, *, at_once: bool = False) -> None:
        """Log a sum for each reason that is due. Call it from time to time.

        Args:
            at_once: Whether all are due, because the program ends.
        """
        if not self._omitting:
            return
        now = self._clock()
        for reason, state in tuple(self._omitting.items()):
            if at_once or now - state.began >= self._period_sec:
                del self._omitting[reason]
                omitted, state.omitted, state.began = state.omitted, 0, now
                self._write(omitted, reason)
