"""A `Clock` to read, and to sleep by."""

from __future__ import annotations

import asyncio
import inspect
import math
import time
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

from actors.errors import NodeDestroyed, TimeSourceChanged
from actors.time.jumps import ClockChange, JumpHandle
from actors.time.ros_time import RosTime
from actors.time.types import NANOSECONDS_PER_SECOND, ClockType, Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.time.jumps import JumpThreshold, TimeJump

_LONGEST_WAIT_SEC: Final = 86_400.0
"""Longer sleeps are split, because some loops limit their timers."""
_RECHECK_SEC: Final = 1.0
"""How often a sleep until a point in time reads the clock again, because somebody may set the wall clock."""


Schedule: TypeAlias = "Callable[[Callable[[], None]], Cancellable]"


class Cancellable(Protocol):
    """A call that is scheduled."""

    def cancel(self) -> object:
        """Cancel the call."""
        ...


class Clock:
    """A clock to read, and to sleep by on the running asyncio loop.

    Args:
        clock_type: STEADY_TIME counts from an arbitrary zero and never jumps; the others are the wall clock.
            A node's own clock is of ROS_TIME and shows simulated time while `use_sim_time` is set.
        source: Function to read instead, in nanoseconds, for tests.
        ros_time: Simulated time, set by the node.
    """

    def __init__(
        self,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
        *,
        source: Callable[[], int] | None = None,
        ros_time: RosTime | None = None,
    ) -> None:
        self._clock_type = ClockType(clock_type)
        steady = self._clock_type is ClockType.STEADY_TIME
        self._real_source = source or (time.monotonic_ns if steady else time.time_ns)
        # Replaced when the source of time changes, so that `now` need not ask which one applies.
        self._source = self._real_source
        self._ros_time = ros_time or RosTime(_raise)
        self._ros_time.followers[self._jumped] = None
        # All sleeps of this clock, to be woken when it is destroyed or jumps. A sleep that only had a timer
        # would go on by a time that no longer applies.
        self._sleepers: set[asyncio.Future[None]] = set()
        self._destroyed = False

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock."""
        return self._clock_type

    @property
    def ros_time_is_active(self) -> bool:
        """Whether it shows simulated time."""
        return self._ros_time.active

    def __repr__(self) -> str:
        return f"Clock(clock_type={self._clock_type.name})"

    def now(self) -> Time:
        """Return the current time; zero if time is simulated and none has been received yet."""
        return Time(nanoseconds=self._source(), clock_type=self._clock_type)

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], None] | None = None,
        post_callback: Callable[[TimeJump], None] | None = None,
    ) -> JumpHandle:
        """Call functions before and after simulated time jumps.

        They are called at once, between two steps of other callbacks, and must not wait.

        Args:
            threshold: Which jumps to report.
            pre_callback: Called before the clock shows the new time.
            post_callback: Called when it does, with the jump.

        Returns:
            A handle, whose `unregister` ends the reports.

        Raises:
            ValueError: There is no callback.
            TypeError: A callback is not callable, or is an `async def`.
        """
        if pre_callback is None and post_callback is None:
            raise ValueError("One of pre_callback or post_callback must be callable")
        for callback in (pre_callback, post_callback):
            plain = callable(callback) and not inspect.iscoroutinefunction(callback)
            if callback is not None and not plain:
                raise TypeError(f"A jump callback must be a plain function, got {callback!r}")
        return JumpHandle(self._ros_time.jump_callbacks, threshold, pre_callback, post_callback)

    async def sleep_for(self, duration: Duration | float) -> None:
        """Sleep for a duration.

        It is measured in simulated time, from the first that is received, or by the loop's clock: setting the
        wall clock does not affect it.

        Args:
            duration: A Duration, or seconds; zero or less returns immediately.

        Raises:
            NodeDestroyed: The clock, which ends with its node, was destroyed before or during the sleep.
            TimeSourceChanged: Simulated time was switched on or off during the sleep.
            ValueError: The duration is not a number.
        """
        self._require_alive()
        seconds = (
            duration.nanoseconds / NANOSECONDS_PER_SECOND if isinstance(duration, Duration) else duration
        )
        if math.isnan(seconds):
            raise ValueError("the duration of a sleep must be a number, not nan")
        ros_time, loop = self._ros_time, asyncio.get_running_loop()
        if ros_time.active and seconds > 0:
            # Before the first message of `/clock` the time is 0. A deadline from there would be in the past
            # as soon as the real value arrives, and the sleep would end at once.
            while not ros_time.known:
                await self._wait(partial(ros_time.call_at, 0))  # until a time is set
            nanoseconds = seconds * NANOSECONDS_PER_SECOND
            whole = round(nanoseconds) if math.isfinite(nanoseconds) else nanoseconds
            deadline_ns = ros_time.time() + whole
            while ros_time.time() < deadline_ns:
                await self._wait(partial(ros_time.call_at, deadline_ns))
            return
        # The loop's clock and not this one: a duration is not affected by somebody who sets the wall clock.
        deadline = loop.time() + seconds
        # In a loop, because a jump wakes all sleeps to let them look again.
        while (remaining := deadline - loop.time()) > 0:
            await self._wait(partial(loop.call_later, min(remaining, _LONGEST_WAIT_SEC)))

    sleep = sleep_for

    async def sleep_until(self, until: Time) -> None:
        """Sleep until a point in time.

        Args:
            until: A time of this kind of clock; one in the past returns immediately.

        Raises:
            NodeDestroyed: The clock, which ends with its node, was destroyed before or during the sleep.
            TimeSourceChanged: Simulated time was switched on or off during the sleep.
            ValueError: `until` is of another kind of clock.
        """
        self._require_alive()
        if until.clock_type is not self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        ros_time, loop = self._ros_time, asyncio.get_running_loop()
        while (remaining := until.nanoseconds - self._source()) > 0:
            if ros_time.active:
                schedule: Schedule = partial(ros_time.call_at, until.nanoseconds)
            else:
                schedule = partial(loop.call_later, min(remaining / NANOSECONDS_PER_SECOND, _RECHECK_SEC))
            await self._wait(schedule)

    def destroy(self) -> None:
        """End all sleeps: these and further ones raise NodeDestroyed. The clock can still be read."""
        self._destroyed = True
        for sleeper in self._sleepers:
            _wake(sleeper)

    async def _wait(self, schedule: Schedule) -> None:
        active = self._ros_time.active
        sleeper: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        handle = schedule(partial(_wake, sleeper))
        self._sleepers.add(sleeper)
        try:
            await sleeper
        finally:
            # Also after a normal end: a sleeper that was woken by a jump has left its timer.
            handle.cancel()
            self._sleepers.discard(sleeper)
        # Checked here and not where the sleeper was woken: both can also happen between the wake-up and now.
        self._require_alive()
        if self._ros_time.active is not active:
            raise TimeSourceChanged("use_sim_time has changed during a sleep")

    def _jumped(self, change: ClockChange, delta: int) -> None:
        """Show the time of the new source, and wake all sleeps to look at the time and its source."""
        del change, delta
        ros_time = self._ros_time
        self._source = ros_time.time if ros_time.active else self._real_source
        # Waking only schedules the tasks, so the set does not change in this loop.
        for sleeper in self._sleepers:
            _wake(sleeper)

    def _require_alive(self) -> None:
        if self._destroyed:
            raise NodeDestroyed("cannot sleep on a destroyed clock")


def ros_time_of(clock: Clock) -> RosTime:
    """Return the simulated time behind a clock, which only a node's own clock ever shows."""
    return clock._ros_time  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]


async def wait_on(clock: Clock, schedule: Schedule) -> None:
    """Wait once, as sleeps of the clock do.

    Args:
        clock: The clock. Waits end with it, and when simulated time is switched on or off.
        schedule: Gets a function that ends the wait, and schedules it. A wait also ends when simulated time
            becomes known, or goes back.
    """
    clock._require_alive()  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]
    await clock._wait(schedule)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]


def _wake(sleeper: asyncio.Future[None]) -> None:
    if not sleeper.done():
        sleeper.set_result(None)


def _raise(error: BaseException) -> None:
    raise error
