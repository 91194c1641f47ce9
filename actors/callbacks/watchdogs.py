"""Something that has to happen once in a while: a publisher's deadline, a lease.

A watchdog is fed on the hot path (one look at the clock) and has one timer, however often it is fed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

STALL_SEC: Final = 0.01
"""A timer that comes this late says that the loop was busy: food may lie in a socket nobody has read yet."""

SECOND_LOOK_SEC: Final = 0.05
"""How long after such a stall the dog is looked at again."""


class Watchdog:
    """Barks when it has not been fed for a period.

    Args:
        loop: Whose clock it goes by.
        period_s: How long food lasts, in seconds, above 0.
        on_expired: Told how many periods have passed hungry, one or more, since the last bark.
        once: Bark once, and then not before it has been fed again.
    """

    __slots__ = ("_handle", "_looked_twice", "_loop", "_on_expired", "_once", "_reset_at", "period_s")

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
        self._looked_twice = False
        self._handle: asyncio.TimerHandle | None = None

    def reset(self) -> None:
        """What was to happen has happened; the first time starts the watch."""
        self._reset_at = self._loop.time()
        if self._handle is None:
            self._look_at(self._reset_at + self.period_s)

    def stop(self) -> None:
        """Watch no more, until it is fed again."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def _look_at(self, when: float) -> None:
        self._handle = self._loop.call_at(when, self._look)

    def _look(self) -> None:
        now, due = self._loop.time(), self._reset_at + self.period_s
        self._handle = None
        if now < due:
            self._looked_twice = False
            self._look_at(due)
        elif now - due > STALL_SEC and not self._looked_twice:
            self._looked_twice = True
            self._look_at(now + min(SECOND_LOOK_SEC, self.period_s))
        else:
            self._looked_twice = False
            periods = max(1, int((now - self._reset_at) / self.period_s))
            if not self._once:
                self._reset_at += periods * self.period_s
                self._look_at(self._reset_at + self.period_s)
            self._on_expired(periods)
