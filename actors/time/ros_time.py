"""Simulated time: the state behind a ROS_TIME clock, and what depends on its jumps.

While it is active, time is what was set last: it stands still between two settings and may go back. Timers
and sleeps are scheduled here with `call_at`, as on an event loop, but in integer nanoseconds.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actors.time.jumps import ClockChange, TimeJump
from actors.time.types import Duration

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.time.jumps import JumpHandle


class RosTime:
    """The simulated time of one clock.

    Args:
        on_error: Called with what a jump callback raises, which may be SystemExit or KeyboardInterrupt.

    Attributes:
        active: Whether the clock shows simulated time.
        known: Whether a time has been set.
        jump_callbacks: The users' callbacks, in the order of creation.
        followers: Called after the source of time has changed, after the first time has been set, and after
            time has gone back; with what has changed, and the new time minus the old in nanoseconds.
    """

    def __init__(self, on_error: Callable[[BaseException], None]) -> None:
        self.active = False
        self.known = False
        self.jump_callbacks: dict[JumpHandle, None] = {}
        self.followers: dict[Callable[[ClockChange, int], None], None] = {}
        self._on_error = on_error
        self._now = 0
        # A dict as a set that keeps its order: calls for the same time run in the order in which they were
        # scheduled.
        self._calls: dict[ScheduledCall, None] = {}
        # Messages of `/clock` may come a thousand times a second, and seldom make anything due: this
        # comparison spares the search. A cancelled call may leave it too early, which costs one search.
        self._next: float = math.inf
        """No call is due before this."""

    def time(self) -> int:
        """Return the time that was set last, in nanoseconds; 0 before that."""
        return self._now

    def activate(self, *, active: bool) -> None:
        """Change the source of time, which counts as a jump of zero length."""
        if active is self.active:
            return
        change = ClockChange.ROS_TIME_ACTIVATED if active else ClockChange.ROS_TIME_DEACTIVATED
        with self._jump(change, 0):
            self.active = active
            self._notify(change, 0)

    def set(self, nanoseconds: int) -> None:
        """Set the time, and run what is due. While it is not active, nothing jumps."""
        delta = nanoseconds - self._now
        first, self.known = not self.known, True
        if not self.active:
            self._now = nanoseconds
            return
        with self._jump(ClockChange.ROS_TIME_NO_CHANGE, delta):
            self._now = nanoseconds
            # Steps forward need no notice: everything that waits for them is in `_calls`.
            if first or delta < 0:
                self._notify(ClockChange.ROS_TIME_NO_CHANGE, delta)
        # After the jump callbacks, so that timers that become due find everything else at the new time.
        if nanoseconds >= self._next:
            self._run_due()

    def call_at(self, when: float, callback: Callable[[], None]) -> ScheduledCall:
        """Call a function when a time at or after `when` is set.

        Args:
            when: Nanoseconds.
            callback: The function.

        Returns:
            The call, which can be cancelled.
        """
        call = ScheduledCall(self._calls, when, callback)
        self._next = min(self._next, when)
        return call

    def _run_due(self) -> None:
        due = sorted((call for call in self._calls if call.when <= self._now), key=lambda call: call.when)
        for call in due:
            if call in self._calls:  # not cancelled by one before it
                # Before the call, which may schedule itself again.
                call.cancel()
                call.callback()
        self._next = min((call.when for call in self._calls), default=math.inf)

    def _notify(self, change: ClockChange, delta: int) -> None:
        # A copy: a follower may create or destroy a clock.
        for follower in tuple(self.followers):
            follower(change, delta)

    @contextmanager
    def _jump(self, change: ClockChange, delta: int) -> Generator[None]:
        """Call those jump callbacks that want this jump, before and after it."""
        # Chosen before the jump: a callback that is registered in between has seen no `pre`, and gets no
        # `post`.
        callbacks = [each for each in self.jump_callbacks if each.threshold.admits(change, delta)]
        for each in callbacks:
            self._call(each.pre_callback)
        yield
        if callbacks:
            jump = TimeJump(change, Duration(nanoseconds=delta))
            for each in callbacks:
                self._call(each.post_callback, jump)

    def _call(self, callback: Callable[..., None] | None, *arguments: TimeJump) -> None:
        try:
            if callback is not None:
                callback(*arguments)
        except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, time goes on
            self._on_error(error)


class ScheduledCall:
    """A call scheduled by `RosTime.call_at`.

    Attributes:
        when: The time in nanoseconds.
        callback: The function.
    """

    __slots__ = ("_calls", "callback", "when")

    def __init__(self, calls: dict[ScheduledCall, None], when: float, callback: Callable[[], None]) -> None:
        self._calls = calls
        self.when = when
        self.callback = callback
        calls[self] = None

    def cancel(self) -> None:
        """Do not call the function. A second call does nothing."""
        self._calls.pop(self, None)
