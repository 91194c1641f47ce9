"""Computes when the messages of a bag are due. Pure: the time is an argument.

    schedule.start(now_ns)
    wait_ns = schedule.wait_ns(message_time_ns, now_ns)     None while paused
    if wait_ns == 0: publish; schedule.played(message_time_ns)

The anchor ties two clocks together: it is a reading of the machine's monotonic clock, and the time of the bag
at that moment. The due time of each message is computed from the anchor, not from the preceding message, so
that errors do not add up. Pausing, seeking and changing the rate move the anchor.
"""

from __future__ import annotations

import math
from typing import Final

from actors.bags.errors import InvalidBagOptionError
from actors.time.types import NANOSECONDS_PER_SECOND

MIN_RATE: Final = 1e-6
MAX_RATE: Final = 1e9
"""Limits for the rate: beyond them, waits and positions would exceed the range of times in nanoseconds."""


class Schedule:
    """Computes when messages are due.

    Args:
        start_ns: Time of the bag's first message.
        end_ns: Time of its last message.
        rate: Seconds of the bag to play per second.
        start_offset_ns: Start this many nanoseconds after the first message.
        delay_ns: Nanoseconds to wait before each pass through the bag.
        duration_ns: Nanoseconds of the bag to play; 0: nothing; None for all.
        until_ns: Play up to this time of the bag; None for all. With a duration, the later end counts.
        is_paused: Whether to start paused.

    Attributes:
        begin_ns: The time of the bag at which each pass begins.
        stop_ns: The last time of the bag that is played.
        rate: Seconds of the bag that are played per second.
        is_paused: Whether the time of the bag stands still.

    Raises:
        InvalidBagOptionError: An argument is out of range.
    """

    def __init__(
        self,
        start_ns: int,
        end_ns: int,
        *,
        rate: float = 1.0,
        start_offset_ns: int = 0,
        delay_ns: int = 0,
        duration_ns: int | None = None,
        until_ns: int | None = None,
        is_paused: bool = False,
    ) -> None:
        for name, value in {"start offset": start_offset_ns, "delay": delay_ns}.items():
            if value < 0:
                raise InvalidBagOptionError(f"The {name} cannot be negative")
        self.start_ns = start_ns
        self.end_ns = max(end_ns, start_ns)
        self._delay_ns = delay_ns
        self.is_paused = is_paused
        self.rate = checked_rate(rate)
        self._steps = 0
        """Number of next messages that are due at once, although it is paused."""
        self.set_range(start_offset_ns, duration_ns, until_ns)
        self.start(0)

    def set_range(self, start_offset_ns: int, duration_ns: int | None, until_ns: int | None) -> None:
        """Set the range to play, from the next pass on.

        Args:
            start_offset_ns: As for the class.
            duration_ns: As for the class.
            until_ns: As for the class.
        """
        self.begin_ns = self.start_ns + start_offset_ns
        # As in ROS 2: a duration of 0 is no time at all, rather than that of the first message.
        limits = [] if duration_ns is None else [self.begin_ns + duration_ns if duration_ns else 0]
        limits += [] if until_ns is None else [until_ns]
        self._limit_ns = max(limits, default=None)
        self.stop_ns = self.end_ns if self._limit_ns is None else min(self._limit_ns, self.end_ns)

    def is_over(self, time_ns: int) -> bool:
        """Return whether a message is behind the range to play.

        Without a limit none is: by publish time, messages can be later than the last time of the bag, by the
        difference between the clocks of two machines.

        Args:
            time_ns: The message's time in the bag.
        """
        return self._limit_ns is not None and time_ns > self._limit_ns

    @property
    def is_empty(self) -> bool:
        """Whether there is no time of the bag to play."""
        return self.stop_ns < self.begin_ns

    def start(self, now_ns: int) -> None:
        """Begin a pass through the bag, after the delay.

        Args:
            now_ns: The monotonic clock.
        """
        self._anchor_ns = now_ns + self._delay_ns
        self._anchor_time_ns = self.begin_ns
        self._paused_delay_ns = self._delay_ns
        """The rest of the delay, while paused."""
        self._steps = 0
        self._latest_ns = self.begin_ns
        """Time of the latest message of this pass; by publish time, it can be behind the end of the bag."""

    def start_again(self, now_ns: int) -> None:
        """Start the next pass at the time at which the preceding one ended, even if `now_ns` is a bit later.

        Args:
            now_ns: The monotonic clock.
        """
        ended_ns = now_ns if self.is_paused else self._due_ns(max(self.stop_ns, self._latest_ns))
        # After a long pause of the machine, or after a burst, missed passes are not made up for.
        late_ns = now_ns - ended_ns
        self.start(ended_ns if 0 <= late_ns <= NANOSECONDS_PER_SECOND else now_ns)

    def position_ns(self, now_ns: int) -> int:
        """Return the time of the bag.

        Args:
            now_ns: The monotonic clock.
        """
        if self.is_paused:
            return self._anchor_time_ns
        elapsed_ns = max(0, now_ns - self._anchor_ns)
        return min(self._anchor_time_ns + round(elapsed_ns * self.rate), max(self.stop_ns, self.begin_ns))

    def wait_ns(self, time_ns: int, now_ns: int) -> int | None:
        """Return how long to wait until a message is due: 0 if it is due, None while paused.

        Args:
            time_ns: The message's time in the bag.
            now_ns: The monotonic clock.
        """
        self._latest_ns = max(self._latest_ns, time_ns)
        if self._steps:
            return 0
        if self.is_paused:
            return None
        return max(0, self._due_ns(time_ns) - now_ns)

    def _due_ns(self, time_ns: int) -> int:
        ahead_ns = max(0, time_ns - self._anchor_time_ns)
        return self._anchor_ns + (ahead_ns if self.rate == 1.0 else math.ceil(ahead_ns / self.rate))

    @property
    def steps(self) -> int:
        """Number of next messages that are due at once, although it is paused."""
        return self._steps

    def played(self, time_ns: int) -> None:
        """Note that a message has been published; while stepping, move the time of the bag to it.

        Args:
            time_ns: The message's time in the bag.
        """
        if self._steps:
            self._steps -= 1
            self._anchor_time_ns = max(self._anchor_time_ns, time_ns)

    def step(self, count: int) -> None:
        """Make the next messages due at once, while it is paused.

        Args:
            count: Their number.
        """
        if self.is_paused:
            self._steps += count

    def forget_steps(self) -> None:
        """Cancel `step`."""
        self._steps = 0

    def pause(self, now_ns: int) -> None:
        """Stop the time of the bag.

        Args:
            now_ns: The monotonic clock.
        """
        if not self.is_paused:
            self._paused_delay_ns = max(0, self._anchor_ns - now_ns)
            self._anchor_time_ns = self.position_ns(now_ns)
            self.is_paused = True

    def resume(self, now_ns: int) -> None:
        """Continue the time of the bag.

        Args:
            now_ns: The monotonic clock.
        """
        if self.is_paused:
            self._anchor_ns = now_ns + self._paused_delay_ns
            self._steps = 0
            self.is_paused = False

    def set_rate(self, rate: float, now_ns: int) -> None:
        """Change the rate.

        Args:
            rate: Seconds of the bag to play per second.
            now_ns: The monotonic clock.

        Raises:
            InvalidBagOptionError: The rate is out of range.
        """
        checked = checked_rate(rate)
        if not self.is_paused and now_ns > self._anchor_ns:
            self._anchor_time_ns, self._anchor_ns = self.position_ns(now_ns), now_ns
        self.rate = checked

    def has(self, time_ns: int) -> bool:
        """Return whether `seek` can go to a time of the bag."""
        return self.start_ns <= time_ns <= self.end_ns

    def seek(self, time_ns: int, now_ns: int) -> None:
        """Continue at a time of the bag, without the delay.

        Args:
            time_ns: The time of the bag.
            now_ns: The monotonic clock.
        """
        self._anchor_ns, self._anchor_time_ns = now_ns, time_ns
        self._paused_delay_ns = self._steps = 0
        self._latest_ns = self.begin_ns


def checked_rate(rate: float) -> float:
    """Return a rate; raise InvalidBagOptionError if it is out of range."""
    if not MIN_RATE <= rate <= MAX_RATE:
        raise InvalidBagOptionError(f"The rate must be from {MIN_RATE:g} to {MAX_RATE:g}, not {rate:g}")
    return float(rate)
