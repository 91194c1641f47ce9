"""The read budget: how long one broker may handle received frames in one turn of its event loop.

A connection that has used its share keeps the rest of what it has read, does not read on, and waits here; so
does one that reads when the budget is exhausted. Each loop turn gives a share to the connections that wait,
first come, first served: signals, timers and other connections get their turn in between, whatever arrives.
"""

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

BUDGET_SEC: Final = 0.010
"""Seconds of handling received frames, and of writing what they cause, in one loop turn."""

SHARE_SEC: Final = 0.002
"""Seconds of it for one connection. Its last frame may exceed them."""

SHARE_FRAMES: Final = 500
"""Frames of one connection in one loop turn."""


class Reader(Protocol):
    """A connection that has received bytes to handle."""

    def go_on_reading(self) -> None:
        """Handle a share of the bytes; call `wait` again if some are left."""
        ...


class ReadBudget:
    """The read budget of one broker.

    Args:
        loop: The broker's event loop.
        clock: Steady seconds, read before and after frames are handled.

    Attributes:
        clock: The same.
        exhausted: Whether further frames must wait for a later loop turn.
        contended: Whether connections wait.
    """

    __slots__ = ("_loop", "_renewal_due", "_spent_sec", "_waiting", "clock", "contended", "exhausted")

    def __init__(
        self, loop: asyncio.AbstractEventLoop, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._loop = loop
        self.clock = clock
        self._spent_sec = 0.0
        self.exhausted = self.contended = False
        self._renewal_due = False
        self._waiting: deque[Reader] = deque()

    def spend(self, seconds: float) -> None:
        """Count the time that handling frames took."""
        self._spent_sec = spent = self._spent_sec + seconds
        # Below a share no renewal is scheduled, so a broker with little to do pays nothing for its budget.
        if spent >= SHARE_SEC:
            self.exhausted = spent >= BUDGET_SEC
            self._renew_later()

    def wait(self, reader: Reader) -> None:
        """Call `reader.go_on_reading` in a later loop turn, after those that wait already."""
        self._waiting.append(reader)
        self.contended = True
        self._renew_later()

    def _renew_later(self) -> None:
        if not self._renewal_due:
            self._renewal_due = True
            self._loop.call_soon(self._renew)

    def _renew(self) -> None:
        """Begin a loop turn with a full budget: each connection that waits gets one share, while it lasts."""
        self._renewal_due = self.exhausted = False
        self._spent_sec = 0.0
        waiting = self._waiting
        try:
            # Only those that wait now: one that waits again gets its next share in the next turn.
            for _ in range(len(waiting)):
                if self.exhausted:
                    break
                waiting.popleft().go_on_reading()
        finally:
            self.contended = bool(waiting)
            if waiting:
                self._renew_later()
