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
"""Longer sleeps are taken in turns, because not every loop's timers reach further."""
_RECHECK_SEC: Final = 1.0
"""A wall clock may be set while somebody sleeps until a point of it; it is looked at again this often."""


class Clock:
    """A clock to read, and to sleep by on the running asyncio loop.

    Args:
        clock_type: STEADY_TIME counts from an arbitrary zero and never jumps; the others are the wall clock.
        source: Nanoseconds to read instead, for tests.
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
        """What it counts from."""
        return self._clock_type

    def __repr__(self) -> str:
        return f"Clock(clock_type={self._clock_type.name})"

    def now(self) -> Time:
        """Read the clock."""
        return Time(nanoseconds=self._source(), clock_type=self._clock_type)

    async def sleep_for(self, duration: Duration | float) -> None:
        """Sleep for a duration, or for a number of seconds; zero and less returns at once.

        Measured by the loop's own clock, so setting the wall clock changes nothing.

        Raises:
            RuntimeError: The clock is destroyed.
            asyncio.CancelledError: It was destroyed meanwhile, or the task was cancelled.
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
        while (left := deadline - loop.time()) > 0:
            await self._wait(loop, min(left, _LONGEST_WAIT_SEC))

    sleep = sleep_for

    async def sleep_until(self, until: Time) -> None:
        """Sleep until this clock shows `until` or later; a point in the past returns at once.

        Raises:
            RuntimeError: The clock is destroyed.
            asyncio.CancelledError: It was destroyed meanwhile, or the task was cancelled.
            ValueError: `until` is of another kind of clock.
        """
        self._require_alive()
        if until.clock_type is not self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        loop = asyncio.get_running_loop()
        while (left := until.nanoseconds - self._source()) > 0:
            await self._wait(loop, min(left / NANOSECONDS_PER_SECOND, _RECHECK_SEC))

    def destroy(self) -> None:
        """Cancel all sleeps; further ones raise RuntimeError. Reading goes on. Harmless twice."""
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
