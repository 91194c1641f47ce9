"""Clocks that block, where callboard's suspend."""

from __future__ import annotations

import weakref
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, Self, cast

from actors.errors import TimeSourceChanged
from actors.ros.process_thread import process_thread
from actors.ros.rclpy.entity import weakly
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.ros.rclpy.utilities import get_default_context
from actors.time.clock import Clock as NativeClock
from actors.time.clock import ros_time_of
from actors.time.jumps import ClockChange as ClockChange
from actors.time.jumps import JumpHandle as JumpHandle
from actors.time.jumps import JumpThreshold as JumpThreshold
from actors.time.jumps import TimeJump as TimeJump
from actors.time.types import ClockType, Duration, Time
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.queued_calls import RecentCalls

P = ParamSpec("P")

__getattr__ = imported_names(__name__, "Context NotInitializedException")


class ClockFollower(Protocol):
    """A timer, as a clock knows it."""

    def jumped(self) -> None:
        """Note a jump of the clock; in the loop."""
        ...


class Clock:
    """A clock to read and to sleep by, in any thread.

    Args:
        clock_type: STEADY_TIME counts from an arbitrary zero; the others are the wall clock.

    Attributes:
        native: callboard's clock.
    """

    def __new__(cls, *args: Any, clock_type: ClockType = ClockType.SYSTEM_TIME, **kwargs: Any) -> Self:
        """Return a ROSClock for ROS time; raise TypeError for what is no kind of clock."""
        del args, kwargs
        if not isinstance(cast("object", clock_type), ClockType):
            raise TypeError(f"clock_type must be a ClockType, got {clock_type!r}")
        made: Any = ROSClock if cls is Clock and clock_type is ClockType.ROS_TIME else cls
        return cast("Self", object.__new__(made))

    def __init__(self, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> None:
        self.native = NativeClock(clock_type)
        self._jump_calls: RecentCalls | None = None
        self._own_jump_calls: deque[Callable[[], None]] = deque()
        """Calls of a clock without a node, for the thread that sets its time."""
        self._followers: dict[int, weakref.ref[ClockFollower]] = {}
        """Timers by their ids. A dict, since its values can be copied while other threads change it."""

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock."""
        return self.native.clock_type

    @property
    def ros_time_is_active(self) -> bool:
        """Whether it shows simulated time."""
        return self.native.ros_time_is_active

    def __repr__(self) -> str:
        return f"Clock(clock_type={self.clock_type.name})"

    def now(self) -> Time:
        """Return the current time."""
        return self.native.now()

    def follow(self, timer: ClockFollower) -> None:
        """Tell a timer of jumps while it exists."""
        followers, number = self._followers, id(timer)
        # Weak: the clock outlives the timers that follow it, and a program may drop one without destroying
        # it.
        followers[number] = weakref.ref(timer, lambda _: followers.pop(number, None))

    def unfollow(self, timer: ClockFollower) -> None:
        """Tell a timer of jumps no more."""
        self._followers.pop(id(timer), None)

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], None] | None = None,
        post_callback: Callable[[TimeJump], None] | None = None,
    ) -> JumpHandle:
        """Call functions when simulated time jumps.

        The clock of a node has its executor call them, so that the time has already changed for both.

        Args:
            threshold: Which jumps.
            pre_callback: `()`, called first.
            post_callback: Gets the jump.

        Returns:
            A handle; the functions are called until its `unregister`.
        """
        before, after = self._queued(pre_callback), self._queued(post_callback)
        return process_thread().call(
            lambda: self.native.create_jump_callback(threshold, pre_callback=before, post_callback=after)
        )

    def _queued(self, callback: Callable[P, None] | None) -> Callable[P, None] | None:
        if callback is None:
            return None
        add = self._own_jump_calls.append if self._jump_calls is None else self._jump_calls.add
        return lambda *args, **kwargs: add(partial(callback, *args, **kwargs))

    def sleep_until(self, until: Time, context: Context | None = None) -> bool:
        """Sleep until a point in time.

        Args:
            until: A time of this kind of clock.
            context: Ends the sleep when it is shut down; None for the default one.

        Returns:
            Whether the time has come; False if the context, or the source of time, has ended the sleep.

        Raises:
            NotInitializedException: The context is not ok.
            ValueError: The time is of another kind of clock.
        """
        if until.clock_type != self.clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        return self._sleep(lambda: self.native.sleep_until(until), context)

    def sleep_for(self, rel_time: Duration, context: Context | None = None) -> bool:
        """Sleep for a duration; arguments, result and errors as for `sleep_until`."""
        return self._sleep(lambda: self.native.sleep_for(rel_time), context)

    def _sleep(self, sleep: Callable[[], Coroutine[Any, Any, None]], context: Context | None) -> bool:
        try:
            (context or get_default_context()).wait(sleep)
        except (TimeSourceChanged, ExternalShutdownException):
            return False
        return True


class ROSClock(Clock):
    """A clock that may be simulated, as a node's own is while the node's parameter `use_sim_time` is set.

    Args:
        native: The node's clock in callboard; None makes one that a program or a `TimeSource` sets.
        jump_calls: Makes the node's calls of jump callbacks.
        clock_type: ROS_TIME, as of every one.
    """

    def __init__(
        self,
        native: NativeClock | None = None,
        jump_calls: RecentCalls | None = None,
        *,
        clock_type: ClockType = ClockType.ROS_TIME,
    ) -> None:
        del clock_type
        super().__init__(clock_type=ClockType.ROS_TIME)
        self._jump_calls = jump_calls
        if native is not None:
            self.native = native
        # Every jump, however small: by simulated time a timer may be due after each message of `/clock`.
        every = JumpThreshold(
            min_forward=Duration(nanoseconds=1),
            min_backward=Duration(nanoseconds=-1),
            on_clock_change=True,
        )
        self.native.create_jump_callback(every, post_callback=weakly(self._jumped))

    def set_ros_time_override(self, time: Time) -> None:
        """Set the time that it shows while it is simulated.

        A node's own clock shows it until the next message of `/clock`.

        Raises:
            TypeError: It is no Time.
        """
        if not isinstance(cast("object", time), Time):
            raise TypeError(f"a clock is set to an rclpy.time.Time, got {type(time).__name__}")
        self._change(lambda: ros_time_of(self.native).set(time.nanoseconds))

    def _set_ros_time_is_active(self, enabled: bool) -> None:
        """Simulate it or not. Private in rclpy, but what programs have that set a clock without a node."""
        self._change(lambda: ros_time_of(self.native).activate(active=enabled))

    def _change(self, change: Callable[[], None]) -> None:
        process_thread().call(change)
        while self._own_jump_calls:
            self._own_jump_calls.popleft()()

    def _jumped(self, jump: TimeJump) -> None:
        del jump
        for each in tuple(self._followers.values()):
            timer = each()
            if timer is not None:
                timer.jumped()
