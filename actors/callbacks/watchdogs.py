"""Watchdogs: timers that expire unless they are reset, for deadlines and liveliness leases.

A reset is on the hot path: it reads the clock once and sets no timer. A watchdog has at most one timer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

STALL_SEC: Final = 0.01
"""If a timer fires this late, the loop was busy, and a reset may wait in a socket that was not read yet."""

SECOND_CHECK_SEC: Final = 0.05
"""Seconds after such a stall until the watchdog checks again."""


class Watchdog:
    """Expires when it has not been reset for a period.

    Args:
        loop: The event loop, whose clock counts.
        period_s: Seconds from a reset until it expires, above 0.
        on_expired: Called with the number of periods, one or more, that have passed without a reset since
            it expired last.
        once: Expire once, and then only after another reset.
    """

    __slots__ = ("_checked_twice", "_handle", "_loop", "_on_expired", "_once", "_reset_at", "period_s")

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        period_s: float,
        on_expired: Callable[[int], None],
        *,
        once: bool = False,
    ) -> None:
        self.period_s = period_s
        self._loop = loop
        self._on_expired = on_expired
        self._once = once
        self._reset_at = 0.0
        self._checked_twice = False
        self._handle: asyncio.TimerHandle | None = None

    def reset(self) -> None:
        """Begin a new period; the first reset starts the watchdog."""
        # Only a number changes. The timer stays where it is, finds out when it fires that it is early, and
        # is set again, so that ten thousand messages a second cost one timer a period.
        self._reset_at = self._loop.time()
        if self._handle is None:
            self._check_at(self._reset_at + self.period_s)

    def stop(self) -> None:
        """Stop until the next reset."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def _check_at(self, when: float) -> None:
        self._handle = self._loop.call_at(when, self._check)

    def _check(self) -> None:
        now, due = self._loop.time(), self._reset_at + self.period_s
        self._handle = None
        if now < due:
            self._checked_twice = False
            self._check_at(due)
        # The loop was blocked, perhaps by the reader's own callback, and the message that resets this may
        # lie unread in the socket. Reporting a missed deadline would blame the publisher. The second check
        # comes after the loop has read; it is not repeated, because a loop that is always busy would then
        # never report.
        elif now - due > STALL_SEC and not self._checked_twice:
            self._checked_twice = True
            self._check_at(now + min(SECOND_CHECK_SEC, self.period_s))
        else:
            self._checked_twice = False
            periods = max(1, int((now - self._reset_at) / self.period_s))
            # From the due time, not from now: late timers must not make the periods drift, or their number
            # wrong.
            if not self._once:
                self._reset_at += periods * self.period_s
                self._check_at(self._reset_at + self.period_s)
            self._on_expired(periods)
