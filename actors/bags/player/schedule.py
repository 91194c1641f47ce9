"""When the messages of a bag are due. Pure: the time is an argument.

    schedule.start(now_ns)
    wait_ns = schedule.wait_ns(message_time_ns, now_ns)     None: not before something else happens
    if wait_ns == 0: publish; schedule.played(message_time_ns)

Two clocks are tied together at one point, the anchor: a reading of the machine's monotonic clock, and the
time of the bag at that moment. Each message's time is computed from the anchor and not from the message
before, so that errors do not add up. Pausing, seeking and another rate move the anchor.
"""

from __future__ import annotations

import math
from typing import Final

from actors.bags.player.errors import InvalidPlayingError

NS_PER_SEC: Final = 10**9
MIN_RATE: Final = 1e-6
MAX_RATE: Final = 1e9
"""Beyond these, waits and positions would no longer be numbers of nanoseconds that a time can have."""


class Schedule:
    """Says when messages are due.

    Args:
        start_ns: The time of the bag's first message.
        end_ns: The time of its last message.
        rate: Seconds of the bag for each second.
        start_offset_ns: Begin this long after the first message.
        delay_ns: Wait so long before each pass through the bag.
        duration_ns: Play this much of the bag; None for all.
        until_ns: Play up to this time of the bag; None for all. With a duration, the later one counts.
        is_paused: Whether to begin paused.

    Attributes:
        begin_ns: The time of the bag where each pass begins.
        stop_ns: The last time of the bag that is played.
        rate: Seconds of the bag for each second.
        is_paused: Whether nothing is due by time.

    Raises:
        InvalidPlayingError: An argument is out of range.
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
                raise InvalidPlayingError(f"The {name} cannot be negative")
        self.start_ns = start_ns
        self.end_ns = max(end_ns, start_ns)
        self._delay_ns = delay_ns
        self.is_paused = is_paused
        self.rate = checked_rate(rate)
        self._steps = 0
        """Messages that are due whatever the time is."""
        self.set_range(start_offset_ns, duration_ns, until_ns)
        self.start(0)

    def set_range(self, start_offset_ns: int, duration_ns: int | None, until_ns: int | None) -> None:
        """Choose what is played from the next pass on.

        Args:
            start_offset_ns: As for the class.
            duration_ns: As for the class.
            until_ns: As for the class.
        """
        self.begin_ns = self.start_ns + start_offset_ns
        limits = [] if duration_ns is None else [self.begin_ns + duration_ns]
        limits += [] if until_ns is None else [until_ns]
        self.stop_ns = min(max(limits, default=self.end_ns), self.end_ns)

    def start(self, now_ns: int) -> None:
        """Begin a pass through the bag, after the delay.

        Args:
            now_ns: The monotonic clock.
        """
        self._anchor_ns = now_ns + self._delay_ns
        self._anchor_time_ns = self.begin_ns
        self._paused_delay_ns = self._delay_ns
        """Of the delay, what is left while paused."""
        self._steps = 0

    def start_again(self, now_ns: int) -> None:
        """Begin the next pass where the one before ended, even if `now_ns` is a bit later.

        Args:
            now_ns: The monotonic clock.
        """
        ended_ns = now_ns if self.is_paused else self._due_ns(max(self.stop_ns, self.begin_ns))
        # After a long halt of the machine, or a burst, the passes that were missed are not made up for.
        late_ns = now_ns - ended_ns
        self.start(ended_ns if 0 <= late_ns <= NS_PER_SEC else now_ns)

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
        """Return how long to wait until a message is due: 0 now, None as long as it is paused.

        Args:
            time_ns: The message's time in the bag.
            now_ns: The monotonic clock.
        """
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
        """How many messages are due whatever the time is."""
        return self._steps

    def played(self, time_ns: int) -> None:
        """Note that a message has been published.

        Args:
            time_ns: Its time in the bag.
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
        """Make nothing due but by time."""
        self._steps = 0

    def pause(self, now_ns: int) -> None:
        """Hold the time of the bag.

        Args:
            now_ns: The monotonic clock.
        """
        if not self.is_paused:
            self._paused_delay_ns = max(0, self._anchor_ns - now_ns)
            self._anchor_time_ns = self.position_ns(now_ns)
            self.is_paused = True

    def resume(self, now_ns: int) -> None:
        """Let the time of the bag go on.

        Args:
            now_ns: The monotonic clock.
        """
        if self.is_paused:
            self._anchor_ns = now_ns + self._paused_delay_ns
            self._steps = 0
            self.is_paused = False

    def set_rate(self, rate: float, now_ns: int) -> None:
        """Go on with another rate.

        Args:
            rate: Seconds of the bag for each second.
            now_ns: The monotonic clock.

        Raises:
            InvalidPlayingError: It is not above 0, or extreme.
        """
        checked = checked_rate(rate)
        if not self.is_paused and now_ns > self._anchor_ns:
            self._anchor_time_ns, self._anchor_ns = self.position_ns(now_ns), now_ns
        self.rate = checked

    def has(self, time_ns: int) -> bool:
        """Return whether `seek` can go to a time of the bag."""
        return self.start_ns <= time_ns <= self.end_ns

    def seek(self, time_ns: int, now_ns: int) -> None:
        """Go to a time of the bag, without a delay.

        Args:
            time_ns: That time.
            now_ns: The monotonic clock.
        """
        self._anchor_ns, self._anchor_time_ns = now_ns, time_ns
        self._paused_delay_ns = self._steps = 0


def checked_rate(rate: float) -> float:
    """Return a rate; raise InvalidPlayingError if it is none."""
    if not MIN_RATE <= rate <= MAX_RATE:
        raise InvalidPlayingError(f"The rate is above 0, from {MIN_RATE:g} to {MAX_RATE:g}, not {rate:g}")
    return float(rate)
