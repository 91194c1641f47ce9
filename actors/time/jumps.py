"""Jumps of a clock's time, under rclpy's names: which ones to report, and what a callback gets."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.time.types import Duration


class ClockChange(IntEnum):
    """How a jump changed the source of a clock's time, with rclpy's numbers."""

    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4


@dataclass(frozen=True, slots=True)
class TimeJump:
    """A jump, as a post callback gets it.

    Attributes:
        clock_change: Whether simulated time was switched on or off.
        delta: New time minus old; zero if the source has changed.
    """

    clock_change: ClockChange
    delta: Duration


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpThreshold:
    """Which jumps to report. Any one condition is enough.

    Attributes:
        min_forward: The least jump forward to report, a positive duration; None to report none.
        min_backward: The least jump back to report, a negative duration; None to report none.
        on_clock_change: Report that simulated time is switched on or off.

    Raises:
        ValueError: A duration has the wrong sign, or no jump would be reported.
    """

    min_forward: Duration | None
    min_backward: Duration | None
    on_clock_change: bool = True

    def __post_init__(self) -> None:
        if self.min_forward is not None and self.min_forward.nanoseconds <= 0:
            raise ValueError("min_forward must be a positive non-zero duration")
        if self.min_backward is not None and self.min_backward.nanoseconds >= 0:
            raise ValueError("min_backward must be a negative non-zero duration")
        # A threshold that never reports is a mistake that would otherwise show only by silence.
        if self.min_forward is None and self.min_backward is None and not self.on_clock_change:
            raise ValueError("At least one jump threshold must be enabled")

    def admits(self, change: ClockChange, delta: int) -> bool:
        """Return whether the threshold reports a jump.

        Args:
            change: Whether it changes the source of time.
            delta: New time minus old, in nanoseconds.

        Returns:
            True if it meets a condition.
        """
        # The length of such a jump means nothing, because it compares two different clocks; it is given as
        # zero.
        if change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED):
            return self.on_clock_change
        forward, backward = self.min_forward, self.min_backward
        return (forward is not None and delta >= forward.nanoseconds) or (
            backward is not None and delta <= backward.nanoseconds
        )


class JumpHandle:
    """A registered pair of jump callbacks; also a context manager that unregisters it at the end.

    Made by `Clock.create_jump_callback`.

    Attributes:
        threshold: Which jumps are reported.
        pre_callback: Called before a jump.
        post_callback: Called after it.
    """

    def __init__(
        self,
        _registered: dict[JumpHandle, None],
        threshold: JumpThreshold,
        pre_callback: Callable[[], None] | None,
        post_callback: Callable[[TimeJump], None] | None,
    ) -> None:
        self.threshold = threshold
        self.pre_callback = pre_callback
        self.post_callback = post_callback
        self._registered = _registered
        # The dict belongs to the clock's `RosTime`; the handle is its own key, so that removing it needs no
        # search.
        _registered[self] = None

    def unregister(self) -> None:
        """Report no further jumps. A second call does nothing."""
        self._registered.pop(self, None)

    def __enter__(self) -> Self:
        """Return the handle."""
        return self

    def __exit__(self, *_: object) -> None:
        """Unregister it."""
        self.unregister()
