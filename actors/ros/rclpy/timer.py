"""Timers and rates."""

from __future__ import annotations

import inspect
import threading
from concurrent.futures import Future
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Final

from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.entity import Entity
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.ros.rclpy.exceptions import ROSInterruptException
from actors.time.types import ClockType, Time
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.clock import Clock
    from actors.ros.rclpy.context import Context

_LONGEST_WAIT_SEC: Final = 1.0
"""How often a timer of a wall clock looks at it, since it may be set."""

__getattr__ = imported_names(__name__, "CallbackGroup Clock Context get_default_context")


class TimerInfo:
    """The time at which a call of a timer was due, and the time at which it was made.

    Args:
        expected_call_time: In nanoseconds.
        actual_call_time: In nanoseconds.
        clock_type: The clock that showed them.
    """

    def __init__(
        self,
        *,
        expected_call_time: int = 0,
        actual_call_time: int = 0,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        if expected_call_time < 0 or actual_call_time < 0:
            raise ValueError("call time values must not be negative")
        self.expected_call_time = Time(nanoseconds=expected_call_time, clock_type=clock_type)
        self.actual_call_time = Time(nanoseconds=actual_call_time, clock_type=clock_type)


class Timer(Entity):
    """Calls a callback again and again. Made by `Node.create_timer`.

    Calls are due at whole periods from the start. One call replaces all that were missed while nobody spun.

    Attributes:
        callback: `()`, or with one parameter that is annotated as TimerInfo.
        clock: The clock that it follows.
    """

    def __init__(
        self,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup,
        timer_period_ns: int,
        clock: Clock,
        *,
        context: Context | None = None,
        autostart: bool = True,
    ) -> None:
        if timer_period_ns < 0:
            raise RCLError(f"timer period must be non-negative, got {timer_period_ns} ns")
        super().__init__(callback_group)
        self.callback = callback
        self.clock = clock
        self._lock = threading.RLock()  # a callback that a signal handler interrupts may be in `reset`
        self._has_jumped = False
        self._period = int(timer_period_ns)
        self._last = clock.now().nanoseconds
        self._next = self._last + self._period
        self._canceled = not autostart
        clock.follow(self)

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds; a new one holds from the next call on."""
        with self.handle:
            return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        self._period = int(value)

    def _now(self) -> int:
        with self.handle:
            return self.clock.now().nanoseconds

    def is_ready(self) -> bool:
        """Return whether a call is due."""
        self._apply_jump()
        return not self._canceled and self._now() >= self._next

    def is_canceled(self) -> bool:
        """Return whether it makes no calls."""
        self._now()
        return self._canceled

    def cancel(self) -> None:
        """Make no calls; `reset` starts again."""
        self._now()
        self._canceled = True

    def reset(self) -> None:
        """Start again: the next call is one period from now."""
        with self._lock:
            self._last = self._now()
            self._next = self._last + self._period
            self._canceled = False
        self.rearm()

    def time_since_last_call(self) -> int:
        """Return the nanoseconds since the last call, or the start."""
        return self._now() - self._last

    def time_until_next_call(self) -> int | None:
        """Return the nanoseconds until the next call, negative if it is late; None if it is cancelled."""
        now = self._now()
        self._apply_jump()
        return None if self._canceled else self._next - now

    def rearm(self) -> None:
        """Tell the executor that the next call is due at another time."""
        executor = self.active_executor
        if executor is not None:
            executor.work.timers_changed()

    def jumped(self) -> None:
        """Note a jump of the clock; in the loop, so without the lock."""
        self._has_jumped = True
        self.rearm()

    def _apply_jump(self) -> None:
        """Make the next call due within one period, if time has jumped back."""
        if not self._has_jumped:
            return
        with self._lock:
            if self._has_jumped:
                self._has_jumped = False
                now = self.clock.now().nanoseconds
                if self._next - now > self._period:
                    self._last, self._next = now, now + self._period

    def remaining_sec(self) -> float:
        """Return for how long the executor need not look at it: zero or less if it is due."""
        if self._canceled or self._is_destroyed:
            return inf
        self._apply_jump()
        rest = (self._next - self.clock.now().nanoseconds) / 1e9
        if rest <= 0:
            return rest
        if self.clock.ros_time_is_active:
            return inf  # `jumped` wakes the executor
        # A steady clock cannot be set. The others can, so that their timers look at them at least once a
        # second.
        return rest if self.clock.clock_type is ClockType.STEADY_TIME else min(rest, _LONGEST_WAIT_SEC)

    def has_work(self) -> bool:
        """Return False: the executor looks at when the next call is due."""
        return False

    def take(self) -> Callable[[], Any] | None:
        """Return a call of the callback if one is due."""
        with self._lock:
            if self._canceled or self._is_destroyed:
                return None
            self._apply_jump()
            now, expected = self.clock.now().nanoseconds, self._next
            # It has been reset, or the clock has gone back, since the executor found it due.
            if now < expected:
                return None
            self._last = now
            # From the due time, not from now, so that the calls do not drift; all missed ones are skipped,
            # as in rcl.
            late = now - expected
            self._next = expected + (late // self._period + 1) * self._period if self._period else now
        # Outside the lock: the executor has locks of its own.
        self.rearm()
        callback = self.callback
        if callback is None:
            return None
        name = _info_parameter(callback)
        if name is None:
            return callback
        info = TimerInfo(expected_call_time=expected, actual_call_time=now, clock_type=self.clock.clock_type)
        return partial(callback, **{name: info})

    def destroy(self) -> None:
        """Make no further calls."""
        super().destroy()
        self.clock.unfollow(self)


def _info_parameter(callback: Callable[..., Any]) -> str | None:
    """Return the name of the parameter that gets the TimerInfo: the one with that annotation."""
    for parameter in inspect.signature(callback).parameters.values():
        if parameter.annotation in {TimerInfo, "TimerInfo"}:
            return parameter.name
    return None


class Rate:
    """Sleeps until the next tick, in a thread that does not spin. Made by `Node.create_rate`."""

    def __init__(self, timer: Timer, *, context: Context) -> None:
        self._timer = timer
        self._context = context
        self._lock = threading.RLock()
        self._sleeps: list[Future[None]] = []
        self._missed = False
        """Whether it has ticked while nobody slept."""
        self._destroyed = False
        timer.callback = self._ticked

    def _ticked(self) -> None:
        with self._lock:
            sleeps, self._sleeps = self._sleeps, []
            self._missed = not sleeps
        for sleep in sleeps:
            if sleep.set_running_or_notify_cancel():
                sleep.set_result(None)

    def sleep(self) -> None:
        """Sleep until the next tick of the timer; another thread must spin.

        Return at once if it has ticked since the last sleep: the loop has taken longer than its period.

        Raises:
            ROSInterruptException: The context is shut down.
            RuntimeError: The rate is destroyed.
        """
        sleep = Future[None]()
        with self._lock:
            if self._destroyed and self._context.ok():
                raise RuntimeError("Rate cannot sleep because it has been destroyed")
            if self._missed and self._context.ok():
                self._missed = False
                return
            # Under the same lock as the check: a tick in between would find nobody to wake, and the sleep
            # would be a period too long.
            self._sleeps.append(sleep)
        try:
            self._context.wait_for(sleep)
        except ExternalShutdownException:
            raise ROSInterruptException from None

    def destroy(self) -> None:
        """End all sleeps; further ones raise RuntimeError."""
        with self._lock:
            self._destroyed = True
        self._ticked()

    @property
    def timer(self) -> Timer:
        """The timer behind it."""
        return self._timer
