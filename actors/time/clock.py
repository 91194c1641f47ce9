"""A `Clock` to read, and to sleep by."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING, Final

from actors.time.types import NANOSECONDS_PER_SECOND, ClockType, Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable

_LONGEST_WAIT_SEC: Final = 86_400.0
"""Longer sleeps are split, because some loops limit their timers."""
_RECHECK_SEC: Final = 1.0
"""How often a sleep until a point in time reads the clock again, since a wall clock may be set."""


class Clock:
    """A clock to read, and to sleep by on the running asyncio loop.

    Args:
        clock_type: STEADY_TIME counts from an arbitrary zero and never jumps; the others are the wall clock.
        source: Function to read instead, in nanoseconds, for tests.
    """

    def __init__(
        self,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
        *,
        source: Callable[[], int] | None = None,
    ) -> None:
        self._clock_type = ClockType(clock_type)
        steady = self._clock_type is ClockType.STEADY_TIME
        self._source = source or (time.monotonic_ns if steady else time.time_ns)
        self._sleepers: set[asyncio.Future[None]] = set()
        self._destroyed = False

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock."""
        return self._clock_type

    def __repr__(self) -> str:
        return f"Clock(clock_type={self._clock_type.name})"

    def now(self) -> Time:
        """Return the current time."""
        return Time(nanoseconds=self._source(), clock_type=self._clock_type)

    async def sleep_for(self, duration: Duration | float) -> None:
        """Sleep for a duration, measured by the loop's clock: setting the wall clock does not affect it.

        Args:
            duration: A Duration, or seconds; zero or less returns immediately.

        Raises:
            RuntimeError: The clock is destroyed.
            asyncio.CancelledError: The clock was destroyed during the sleep, or the task was cancelled.
            ValueError: The duration is not a number.
        """
        self._require_alive()
        seconds = (
            duration.nanoseconds / NANOSECONDS_PER_SECOND if isinstance(duration, Duration) else duration
        )
        if math.isnan(seconds):
            raise ValueError("the duration of a sleep must be a number, not nan")
        loop = asyncio.get_running_loop()
        deadline = loop.time() + seconds
        while (remaining := deadline - loop.time()) > 0:
            await self._wait(loop, min(remaining, _LONGEST_WAIT_SEC))

    sleep = sleep_for

    async def sleep_until(self, until: Time) -> None:
        """Sleep until a point in time.

        Args:
            until: A time of this kind of clock; one in the past returns immediately.

        Raises:
            RuntimeError: The clock is destroyed.
            asyncio.CancelledError: The clock was destroyed during the sleep, or the task was cancelled.
            ValueError: `until` is of another kind of clock.
        """
        self._require_alive()
        if until.clock_type is not self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        loop = asyncio.get_running_loop()
        while (remaining := until.nanoseconds - self._source()) > 0:
            await self._wait(loop, min(remaining / NANOSECONDS_PER_SECOND, _RECHECK_SEC))

    def destroy(self) -> None:
        """Cancel all sleeps; further ones raise RuntimeError. The clock can still be read."""
        self._destroyed = True
        for sleeper in self._sleepers:
            sleeper.cancel("the clock is destroyed")

    async def _wait(self, loop: asyncio.AbstractEventLoop, seconds: float) -> None:
        sleeper: asyncio.Future[None] = loop.create_future()
        handle = loop.call_later(seconds, _wake, sleeper)
        self._sleepers.add(sleeper)
        try:
            await sleeper
        finally:
            handle.cancel()
            self._sleepers.discard(sleeper)

    def _require_alive(self) -> None:
        if self._destroyed:
            raise RuntimeError("cannot sleep on a destroyed clock")


def _wake(sleeper: asyncio.Future[None]) -> None:
    if not sleeper.done():
        sleeper.set_result(None)
