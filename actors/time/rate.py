"""A `Rate` to sleep by: for loops that do something a number of times a second."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.errors import NodeDestroyed, TimeSourceChanged
from actors.time.clock import ros_time_of, wait_on
from actors.time.types import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.time.clock import Clock
    from actors.time.ros_time import ScheduledCall

_LONGEST_WAIT_NS: Final = 86_400 * NANOSECONDS_PER_SECOND


class Rate:
    """Sleeps until the next of its ticks. Made by `Node.create_rate`.

    Ticks come at whole periods since it was made in a running loop, or else since the first sleep. Those that
    pass while nobody sleeps are skipped. By simulated time, ticks also begin again with the first time, after
    a step back over more than a period, and when `use_sim_time` changes.

    Args:
        frequency: Ticks a second, more than zero.
        clock: The clock to follow.

    Raises:
        TypeError: The frequency is not a number.
        ValueError: It is zero, negative or not finite.
    """

    def __init__(self, frequency: float, clock: Clock) -> None:
        if isinstance(frequency, bool) or not hasattr(frequency, "__float__"):
            raise TypeError(f"A rate's frequency must be a number, got {frequency!r}")
        if not 0 < frequency < float("inf"):
            raise ValueError(f"A rate's frequency must be greater than zero, got {frequency}")
        # At least a nanosecond: a frequency above 2 GHz would round to 0, and divide by it later.
        self._period = max(1, round(NANOSECONDS_PER_SECOND / frequency))
        self._clock = clock
        self._ros_time = ros_time_of(clock)
        self._source: tuple[bool, bool] | None = None
        """Whether time was simulated and known at the last tick; None before the first."""
        self._tick = 0
        self._wakers: dict[Callable[[], None], None] = {}
        self._destroyed = False
        try:
            # So that the first sleep ends one period after the rate was made, as with rclpy, however long
            # the setup in between takes.
            self._restart(asyncio.get_running_loop())
        except RuntimeError:
            return  # it starts with the first sleep

    async def sleep(self) -> None:
        """Sleep until the next tick, or until the rate is destroyed.

        Raises:
            NodeDestroyed: The rate has been destroyed before; or its clock, which ends with its node, before
                or during the sleep.
        """
        if self._destroyed:
            raise NodeDestroyed("cannot sleep on a destroyed rate")
        loop = asyncio.get_running_loop()
        if self._source is None:
            self._restart(loop)
        source = self._source
        # From the last tick, not from now: what the body of the loop takes does not add to the period.
        passed = max(0, self._now(loop) - self._tick)
        tick = self._tick + (passed // self._period + 1) * self._period
        while not self._destroyed:
            left = tick - self._now(loop)
            # Time has gone back, or comes from another clock: the planned tick means nothing any more, and
            # might be hours away. A step back of less than a period only makes this sleep a little longer.
            if source != self._source_now() or left > self._period:
                self._restart(loop)
                source, left, tick = self._source, self._period, self._tick + self._period
            if left <= 0:
                break
            try:
                await wait_on(self._clock, partial(self._schedule, loop, left))
            # Not an error for a rate: the next round starts its ticks again.
            except TimeSourceChanged:
                continue
        # `max`, as several tasks may sleep by one rate, and their order of waking is not defined.
        self._tick = max(self._tick, tick)

    def destroy(self) -> None:
        """Wake tasks that sleep; further sleeps raise NodeDestroyed. A second call does nothing."""
        self._destroyed = True
        for wake in self._wakers:
            wake()

    def _source_now(self) -> tuple[bool, bool]:
        return self._ros_time.active, self._ros_time.active and self._ros_time.known

    def _now(self, loop: asyncio.AbstractEventLoop) -> int:
        return self._ros_time.time() if self._ros_time.active else round(loop.time() * NANOSECONDS_PER_SECOND)

    def _restart(self, loop: asyncio.AbstractEventLoop) -> None:
        self._source = self._source_now()
        self._tick = self._now(loop)

    def _schedule(self, loop: asyncio.AbstractEventLoop, left: int, wake: Callable[[], None]) -> _Waker:
        if self._ros_time.active:
            call: ScheduledCall | asyncio.Handle = self._ros_time.call_at(self._ros_time.time() + left, wake)
        else:
            call = loop.call_later(min(left, _LONGEST_WAIT_NS) / NANOSECONDS_PER_SECOND, wake)
        return _Waker(self._wakers, wake, call)


class _Waker:
    """Wakes a task that sleeps, at a tick or when the rate is destroyed."""

    def __init__(
        self,
        wakers: dict[Callable[[], None], None],
        wake: Callable[[], None],
        call: ScheduledCall | asyncio.Handle,
    ) -> None:
        self._wakers, self._wake, self._call = wakers, wake, call
        wakers[wake] = None

    def cancel(self) -> None:
        self._wakers.pop(self._wake, None)
        self._call.cancel()
