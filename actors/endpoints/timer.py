"""Timers: drift-free, through the mailbox, one tick at a time."""

from __future__ import annotations

import asyncio
import time
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.errors import NodeDestroyed
from actors.time.clock import ros_time_of
from actors.time.jumps import ClockChange
from actors.time.types import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.callbacks.source import Share
    from actors.diagnostics.records import TimerDiagnostics
    from actors.endpoints.context import NodeContext
    from actors.time.clock import Cancellable, Clock

_numbers: Final = count(1)


class TimerInfo(NamedTuple):
    """When a tick was due and when it was run, in ns of the steady clock or of simulated time."""

    expected_call_time: int
    actual_call_time: int


class Timer:
    """Calls a callback every `period_sec` seconds. Made by `Node.create_timer`.

    Ticks are due at whole periods from the start, however long the callback takes; ticks that pass while an
    earlier one still runs or waits are skipped, not made up for. By simulated time, a step over several
    periods is one tick; after a step back the next tick is at most one period away.

    Attributes:
        id: Its number in this process.
        period_sec: The period in seconds.
        clock: The clock that it follows.
    """

    def __init__(
        self,
        context: NodeContext,
        period_sec: float,
        callback: Callable[..., Any],
        *,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> None:
        if callable(period_sec) or not callable(callback):
            raise TypeError(
                "create_timer takes the period in seconds first and then the callback:"
                f" create_timer(0.5, callback), got ({period_sec!r}, {callback!r})"
            )
        if not 0 <= period_sec < float("inf"):
            raise ValueError(f"A timer's period must be zero or more seconds, got {period_sec}")
        context.link.require_thread()
        self._require_thread = context.link.require_thread
        self._source = TimerSource(
            context, period_sec, callback, clock=clock or context.clock, autostart=autostart
        )
        self.id = self._source.id
        self.period_sec = period_sec
        self.clock = clock or context.clock

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds."""
        return round(self.period_sec * 1e9)

    @property
    def ticks(self) -> int:
        """Callbacks run so far."""
        return self._source.calls

    @property
    def skipped(self) -> int:
        """Ticks that were skipped so far."""
        return self._source.skipped

    def cancel(self) -> None:
        """Stop ticking. `reset` starts again."""
        self._require_thread()
        self._source.cancel()

    def reset(self) -> None:
        """Start again: the next tick is one period from now.

        Raises:
            NodeDestroyed: The timer has been destroyed.
        """
        self._require_thread()
        self._source.reset()

    def destroy(self) -> None:
        """Stop for good; a callback that runs is cancelled."""
        self._require_thread()
        self._source.destroy()

    def is_canceled(self) -> bool:
        """Return whether the timer does not tick.

        Returns:
            True after `cancel` or `destroy`, and with `autostart=False` until `reset`.
        """
        return self._source.canceled

    def time_until_next_call(self) -> int | None:
        """Return the time until the next tick.

        Returns:
            Nanoseconds, negative if the tick is late; None if cancelled or the node does not run.
        """
        return self._source.time_until_next_call()


class TimeLine(Protocol):
    """What schedules ticks: the event loop, in seconds, or simulated time, in integer nanoseconds."""

    def time(self) -> float:
        """Return the time of now."""
        ...

    def call_at(self, when: float, callback: Callable[[], None], /) -> Cancellable:
        """Call a function at or after a time."""
        ...


class TimerSource:
    """What the runtime calls on a timer: a `CallbackSource` of the mailbox.

    Attributes:
        calls: Callbacks run so far.
        skipped: Ticks that were skipped so far.
        canceled: Whether it does not tick.
        posted, timing: See `CallbackSource`.
    """

    concurrent = False  # CallbackSource

    def __init__(
        self,
        context: NodeContext,
        period_sec: float,
        callback: Callable[..., Any],
        *,
        clock: Clock,
        autostart: bool,
    ) -> None:
        self._with_info = takes(callback, (0, 1), "timer") == 1
        context.require_alive()
        self.id = next(_numbers)
        self.posted = False
        self.calls = self.skipped = 0
        self.canceled = not autostart
        self.timing = context.watch.of(callback, "a timer")
        self._period_sec = period_sec
        self._context = context
        self._callback = callback
        self._ros_time = ros_time_of(clock)
        self._time_line: TimeLine | None = None
        """What has scheduled the next tick, or did so last."""
        self._unit = 1
        """Units of the time line in a second."""
        self._period = period_sec
        """In units of the time line, as what follows."""
        self._handle: Cancellable | None = None
        self._due: float = 0.0
        self._expected: float = 0.0
        """When the tick that runs, or waits to, was due."""
        self._due_now = False
        self._running: CallbackTask | None = None
        self._destroyed = False
        context.timers[self] = None
        self._ros_time.followers[self._clock_jumped] = None
        self.start()

    def start(self) -> None:
        """Begin to tick, if the node runs; called again when the node starts."""
        loop = self._context.link.loop
        if loop is not None and not self.canceled and self._handle is None and not self._context.stopping:
            self._arm(loop, self._period_sec)

    def _arm(self, loop: asyncio.AbstractEventLoop, delay_sec: float) -> None:
        """Schedule the next tick. Without a period it needs no clock, as it is always due."""
        simulated = self._ros_time.active and self._period_sec > 0
        self._time_line = time_line = self._ros_time if simulated else loop
        self._unit = NANOSECONDS_PER_SECOND if simulated else 1
        self._period = max(1, round(self._period_sec * self._unit)) if simulated else self._period_sec
        self._due = time_line.time() + (round(delay_sec * self._unit) if simulated else delay_sec)
        self._handle = time_line.call_at(self._due, self._tick)

    def _clock_jumped(self, change: ClockChange, delta: int) -> None:
        """Go on with the rest of the period by the new source; after a step back wait one period at most."""
        del delta
        loop, time_line = self._context.link.loop, self._time_line
        if self._handle is None or loop is None or time_line is None:
            return
        rest, earlier_sec = self._due - time_line.time(), (self._due - self._expected) / self._unit
        if change is ClockChange.ROS_TIME_NO_CHANGE and not 0 < rest <= self._period:
            rest = self._period  # the first time, or one before the start of this period
        self._handle.cancel()
        self._arm(loop, rest / self._unit)
        self._expected = self._due - earlier_sec * self._unit  # of a tick that waits

    def cancel(self) -> None:
        """Stop ticking; a callback that runs goes on."""
        self.canceled = True
        self._due_now = False
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def reset(self) -> None:
        """Start again: the next tick is one period from now."""
        if self._destroyed:
            raise NodeDestroyed("This timer has been destroyed")
        self.cancel()
        self.canceled = False
        self.start()

    def destroy(self) -> None:
        """Stop for good; a callback that runs is cancelled."""
        self.cancel()
        self._destroyed = True
        self._context.timers.pop(self, None)
        self._ros_time.followers.pop(self._clock_jumped, None)
        if self._running is not None:
            self._running.cancel()

    def time_until_next_call(self) -> int | None:
        """Return the nanoseconds until the next tick; None if cancelled or the node does not run."""
        time_line = self._time_line
        if self.canceled or time_line is None or self._context.link.loop is None:
            return None
        return round((self._due - time_line.time()) * (NANOSECONDS_PER_SECOND // self._unit))

    def _tick(self) -> None:
        time_line = self._time_line
        assert time_line is not None
        late = time_line.time() - self._due
        if self._due_now or self._running is not None:
            self.skipped += 1
        else:
            self._due_now = True
            self._expected = self._due
        self._handle = None
        if self._period > 0:
            periods = 1
            if late >= self._period:
                periods = int(late // self._period) + 1
                self.skipped += periods - 1
            self._due += periods * self._period
            self._handle = time_line.call_at(max(self._due, time_line.time()), self._tick)
        self._context.mailbox.post(self)

    def _continue(self) -> None:
        """End a tick. Without a period the next is due now; armed earlier, it would make the loop spin."""
        if self._period_sec == 0:
            self.start()

    def has_work(self) -> bool:
        """CallbackSource: whether a tick is due."""
        return self._due_now and self._running is None and not self.canceled

    def dispatch(self, share: Share) -> CallbackTask | None:
        """CallbackSource: run the callback for a tick."""
        del share  # one callback is never too much
        if not self.has_work():
            return None
        self._due_now = False
        self.calls += 1
        try:
            result = self._callback(self._info()) if self._with_info else self._callback()
        except ENDS_PROGRAM:
            raise
        except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, the node lives on
            self._context.callback_failed(self.timing.what, error)
            self._continue()
            return None
        coroutine = as_coroutine(result)
        if coroutine is None:
            self._continue()
            return None
        self._running = CallbackTask(self._context.mailbox, coroutine, self._ended, self.timing)
        return self._running

    def _info(self) -> TimerInfo:
        time_line = self._time_line
        assert time_line is not None
        now_ns = self._ros_time.time() if time_line is self._ros_time else time.monotonic_ns()
        late_ns = round((time_line.time() - self._expected) * (NANOSECONDS_PER_SECOND // self._unit))
        return TimerInfo(now_ns - late_ns, now_ns)

    def _ended(self, result: object, error: BaseException | None) -> None:
        del result
        callback_task, self._running = self._running, None
        destroyed = (
            callback_task is not None
            and callback_task.cancelled
            and isinstance(error, asyncio.CancelledError)
        )
        if error is not None and not destroyed:
            self._context.callback_failed(self.timing.what, error)
        self._continue()

    def diagnostics(self) -> TimerDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import TimerDiagnostics  # noqa: PLC0415 - seldom needed

        return TimerDiagnostics(
            id=self.id,
            period_sec=self._period_sec,
            ticks=self.calls,
            skipped=self.skipped,
            callback=self.timing.diagnostics(self.calls),
        )
