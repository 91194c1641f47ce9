"""Message rates, bandwidth and age over sliding windows. Time is an argument.

    rate = Rate()
    for stamp in (0.0, 0.5, 1.0):
        rate.add(stamp)
    rate.summary().per_sec  # 2.0

`Rate`, `Bandwidth` and `Delay` get each received message. `CounterRate` gets readings of a counter, such as
`TopicStats.messages` of the broker's report, and needs no message. A window holds the last `window` messages;
if these span less than `least_sec`, it holds the messages of the last `least_sec`, so that one burst does not
decide the rate of a fast topic.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

RATE_WINDOW: Final = 10_000
BANDWIDTH_WINDOW: Final = 100
"""Messages in a window; ROS 2's defaults."""
LEAST_SEC: Final = 1.0


class _Window:
    """The sizes of the last messages, by arrival time."""

    def __init__(self, messages: int, least_sec: float) -> None:
        self._messages = messages
        self._least_sec = least_sec
        self.arrivals: deque[tuple[float, array[int]]] = deque()
        """Each arrival time, and the sizes of its messages: a batch arrives at one time."""
        self.count = 0

    def add(self, time_sec: float, size_bytes: int) -> None:
        """Add a message. A time before the last one clears the window: the clock was set back."""
        arrivals = self.arrivals
        if arrivals and time_sec < arrivals[-1][0]:
            arrivals.clear()
            self.count = 0
        if not arrivals or time_sec != arrivals[-1][0]:
            arrivals.append((time_sec, array("Q")))
        arrivals[-1][1].append(size_bytes)
        self.count += 1
        while self.count > self._messages:
            second = arrivals[1 if len(arrivals) > 1 else 0][0]
            # Without its oldest arrival the window would be too short: keep more messages than asked for.
            if time_sec - second < self._least_sec:
                break
            sizes = arrivals[0][1]
            excess = min(len(sizes), self.count - self._messages)
            self.count -= excess
            del sizes[:excess]
            if not sizes:
                arrivals.popleft()


class RateSummary(NamedTuple):
    """A message rate.

    Attributes:
        per_sec: Messages per second.
        min_sec, max_sec: The shortest and the longest time between two messages.
        deviation_sec: The standard deviation of these times.
        window: Messages in the window.
    """

    per_sec: float
    min_sec: float
    max_sec: float
    deviation_sec: float
    window: int


class Rate:
    """The rate of messages, computed from their arrival times.

    Args:
        window: Messages in the window, 2 or more.
        least_sec: The shortest time that the window spans; 0 for exactly `window` messages.
    """

    def __init__(self, window: int = RATE_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = _Window(max(2, window), least_sec)

    def add(self, time_sec: float) -> None:
        """Add a message.

        Args:
            time_sec: When it arrived. A time before the last one (the clock was set back) clears the window.
        """
        self._window.add(time_sec, 0)

    def summary(self) -> RateSummary | None:
        """Return the rate; None while all messages have the same arrival time."""
        arrivals, count = self._window.arrivals, self._window.count
        if len(arrivals) < 2:
            return None
        times = [time_sec for time_sec, _ in arrivals]
        steps = [later - earlier for earlier, later in pairwise(times)]
        gaps = count - len(arrivals[0][1])  # the gap before the first arrival is unknown
        # Messages of one batch arrive at one time: the gaps between them are 0, and not among the steps.
        together = gaps - len(steps)
        mean = (times[-1] - times[0]) / gaps
        squares = sum((step - mean) ** 2 for step in steps) + together * mean**2
        return RateSummary(
            per_sec=1 / mean,
            min_sec=0.0 if together else min(steps),
            max_sec=max(steps),
            deviation_sec=math.sqrt(squares / gaps),
            window=count,
        )


class BandwidthSummary(NamedTuple):
    """A bandwidth.

    Attributes:
        bytes_per_sec: Bytes per second, from the window's first message until now.
        messages: Messages in the window.
        mean_bytes, min_bytes, max_bytes: The sizes of its messages.
    """

    bytes_per_sec: float
    messages: int
    mean_bytes: float
    min_bytes: int
    max_bytes: int


class Bandwidth:
    """The bandwidth of messages, computed from their arrival times and sizes.

    Args:
        window: Messages in the window, 1 or more.
        least_sec: The shortest time that the window spans; 0 for exactly `window` messages.
    """

    def __init__(self, window: int = BANDWIDTH_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = _Window(max(1, window), least_sec)

    def add(self, time_sec: float, size_bytes: int) -> None:
        """Add a message.

        Args:
            time_sec: When it arrived. A time before the last one (the clock was set back) clears the window.
            size_bytes: Its size.
        """
        self._window.add(time_sec, size_bytes)

    def summary(self, now_sec: float) -> BandwidthSummary | None:
        """Return the bandwidth; None while there is no message, or no time has passed since the first.

        Args:
            now_sec: The time now, by the clock of `add`.
        """
        arrivals, count = self._window.arrivals, self._window.count
        if not arrivals or now_sec <= arrivals[0][0]:
            return None
        total = sum(sum(sizes) for _, sizes in arrivals)
        return BandwidthSummary(
            bytes_per_sec=total / (now_sec - arrivals[0][0]),
            messages=count,
            mean_bytes=total / count,
            min_bytes=min(min(sizes) for _, sizes in arrivals),
            max_bytes=max(max(sizes) for _, sizes in arrivals),
        )


class DelaySummary(NamedTuple):
    """The age of messages on arrival.

    Attributes:
        mean_sec, min_sec, max_sec: Their age. It is negative if the sender's clock is ahead of this one.
        deviation_sec: Its standard deviation.
        window: Messages in the window.
    """

    mean_sec: float
    min_sec: float
    max_sec: float
    deviation_sec: float
    window: int


class Delay:
    """The age of messages on arrival.

    Args:
        window: Messages in the window, 1 or more.
    """

    def __init__(self, window: int = RATE_WINDOW) -> None:
        self._ages: deque[float] = deque(maxlen=max(1, window))

    def add(self, age_sec: float) -> None:
        """Add a message.

        Args:
            age_sec: Its age on arrival.
        """
        self._ages.append(age_sec)

    def summary(self) -> DelaySummary | None:
        """Return the age of the messages in the window; None while the window is empty."""
        ages = self._ages
        if not ages:
            return None
        mean = sum(ages) / len(ages)
        return DelaySummary(
            mean_sec=mean,
            min_sec=min(ages),
            max_sec=max(ages),
            deviation_sec=math.sqrt(sum((age - mean) ** 2 for age in ages) / len(ages)),
            window=len(ages),
        )


class CountedRate(NamedTuple):
    """A message rate, computed from a counter.

    Attributes:
        per_sec: Messages per second.
        window: Messages in the window.
    """

    per_sec: float
    window: int


class CountedTraffic(NamedTuple):
    """A bandwidth, computed from counters.

    Attributes:
        bytes_per_sec: Bytes per second, from the window's first reading to its last.
        messages: Messages between these readings.
        mean_bytes: Their mean size; 0 if there are none.
    """

    bytes_per_sec: float
    messages: int
    mean_bytes: float


class _Reading(NamedTuple):
    time_sec: float
    messages: int
    size_bytes: int


class CounterRate:
    """Message rate and bandwidth, computed from readings of counters, without receiving a message.

    A message that a reading counts first arrived at an unknown time since the reading before. The rate is
    therefore taken from one rise of the counter to another: its relative error is the time between two
    readings, divided by the time that the window spans.

    Args:
        window: Messages in the window, 2 or more. This is approximate: one reading may find many.
        least_sec: The shortest time that the window spans.
    """

    def __init__(self, window: int = RATE_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = max(2, window)
        self._least_sec = least_sec
        self._begin: _Reading | None = None
        """The first reading, while it belongs to the window."""
        self._rises: deque[_Reading] = deque()
        """Readings that were higher than the one before."""
        self._last: _Reading | None = None

    def add(self, time_sec: float, messages: int, size_bytes: int) -> None:
        """Add a reading. A counter that has fallen was restarted: the window begins again.

        Args:
            time_sec: When it was taken; not before the last one.
            messages: Messages so far.
            size_bytes: Their total size.
        """
        before, now = self._last, _Reading(time_sec, messages, size_bytes)
        if before is not None and messages < before.messages:
            self._rises.clear()
            before = self._begin = _Reading(time_sec, 0, 0)
        self._last = now
        if before is None:
            self._begin = now
        elif messages > before.messages:
            self._rises.append(now)
            while len(self._rises) > 2 and self._enough_since(self._rises[1]):
                self._rises.popleft()
                self._begin = None

    def _enough_since(self, earlier: _Reading) -> bool:
        last = self._rises[-1]
        return (
            last.messages - earlier.messages >= self._window
            and last.time_sec - earlier.time_sec >= self._least_sec
        )

    @property
    def begun(self) -> bool:
        """Whether there has been a reading."""
        return self._last is not None

    @property
    def total(self) -> int:
        """Messages at the last reading."""
        return 0 if self._last is None else self._last.messages

    def rate(self) -> CountedRate | None:
        """Return the rate between the first and the last rise; None before there are two."""
        if len(self._rises) < 2:
            return None
        first, last = self._rises[0], self._rises[-1]
        if last.time_sec <= first.time_sec:
            return None
        messages = last.messages - first.messages
        return CountedRate(messages / (last.time_sec - first.time_sec), messages + 1)

    def traffic(self) -> CountedTraffic | None:
        """Return the bandwidth from the window's first reading to its last; None before time has passed."""
        first, last = self._begin or (self._rises[0] if self._rises else None), self._last
        if first is None or last is None or last.time_sec <= first.time_sec:
            return None
        messages, size_bytes = last.messages - first.messages, last.size_bytes - first.size_bytes
        return CountedTraffic(
            bytes_per_sec=size_bytes / (last.time_sec - first.time_sec),
            messages=messages,
            mean_bytes=size_bytes / messages if messages else 0.0,
        )
