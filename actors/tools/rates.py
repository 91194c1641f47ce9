"""How often messages come, how large they are and how old: sliding windows, with time as an argument.

    rate = Rate()
    for stamp in (0.0, 0.5, 1.0):
        rate.add(stamp)
    rate.summary().per_sec  # 2.0

`Rate`, `Bandwidth` and `Delay` are given each message that somebody has heard. `CounterRate` is given looks
at a counter, such as `TopicStats.messages` of the broker's report, and needs no message. A window holds the
last `window` messages; while that many come in less than `least_sec`, it holds those of the last `least_sec`:
a fast topic is not to be judged by its last burst.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from itertools import pairwise
from typing import Any, Final, NamedTuple

RATE_WINDOW: Final = 10_000
BANDWIDTH_WINDOW: Final = 100
"""Messages; ROS 2's defaults."""
LEAST_SEC: Final = 1.0


class RateSummary(NamedTuple):
    """How often messages come.

    Attributes:
        per_sec: Messages a second.
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
    """How often messages come, by the times at which they came.

    Args:
        window: The messages to look back on, 2 or more.
        least_sec: The time to look back on at least; 0 for exactly `window` messages.
    """

    def __init__(self, window: int = RATE_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = max(2, window)
        self._least_sec = least_sec
        self._arrivals: deque[tuple[float, int]] = deque()
        """Each time at which messages came, and how many: a run comes as one."""
        self._count = 0

    def add(self, time_sec: float) -> None:
        """A message has come. A time before the last one (the clock was set) begins anew."""
        arrivals = self._arrivals
        if arrivals and time_sec < arrivals[-1][0]:
            arrivals.clear()
            self._count = 0
        if arrivals and time_sec == arrivals[-1][0]:
            arrivals[-1] = (time_sec, arrivals[-1][1] + 1)
        else:
            arrivals.append((time_sec, 1))
        self._count += 1
        self._slide(time_sec)

    def _slide(self, now: float) -> None:
        arrivals = self._arrivals
        while self._count > self._window and now - _second(arrivals) >= self._least_sec:
            time_sec, count = arrivals[0]
            gone = min(count, self._count - self._window)
            self._count -= gone
            if gone == count:
                arrivals.popleft()
            else:
                arrivals[0] = (time_sec, count - gone)

    def summary(self) -> RateSummary | None:
        """Return what the window says; None while all of it came at one time."""
        if len(self._arrivals) < 2:
            return None
        times = [time_sec for time_sec, _ in self._arrivals]
        steps = [later - earlier for earlier, later in pairwise(times)]
        gaps = self._count - self._arrivals[0][1]  # how long the first ones were waited for is not known
        together = gaps - len(steps)
        mean = (times[-1] - times[0]) / gaps
        squares = sum((step - mean) ** 2 for step in steps) + together * mean**2
        return RateSummary(
            per_sec=1 / mean,
            min_sec=0.0 if together else min(steps),
            max_sec=max(steps),
            deviation_sec=math.sqrt(squares / gaps),
            window=self._count,
        )


def _second(arrivals: deque[tuple[float, Any]]) -> float:
    """Return where the window would begin without its first arrival."""
    return arrivals[1][0] if len(arrivals) > 1 else arrivals[0][0]


class BandwidthSummary(NamedTuple):
    """How many bytes come.

    Attributes:
        bytes_per_sec: From the window's first message until now.
        messages: Messages in the window.
        mean_bytes, min_bytes, max_bytes: A message's size.
    """

    bytes_per_sec: float
    messages: int
    mean_bytes: float
    min_bytes: int
    max_bytes: int


class Bandwidth:
    """How many bytes come, by the sizes of messages and the times at which they came.

    Args:
        window: The messages to look back on, 1 or more.
        least_sec: The time to look back on at least; 0 for exactly `window` messages.
    """

    def __init__(self, window: int = BANDWIDTH_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = max(1, window)
        self._least_sec = least_sec
        self._arrivals: deque[tuple[float, array[int]]] = deque()
        """Each time at which messages came, and their sizes."""
        self._count = 0

    def add(self, time_sec: float, size_bytes: int) -> None:
        """A message has come. A time before the last one (the clock was set) begins anew."""
        arrivals = self._arrivals
        if arrivals and time_sec < arrivals[-1][0]:
            arrivals.clear()
            self._count = 0
        if not arrivals or time_sec != arrivals[-1][0]:
            arrivals.append((time_sec, array("Q")))
        arrivals[-1][1].append(size_bytes)
        self._count += 1
        while self._count > self._window and time_sec - _second(arrivals) >= self._least_sec:
            sizes = arrivals[0][1]
            gone = min(len(sizes), self._count - self._window)
            self._count -= gone
            del sizes[:gone]
            if not sizes:
                arrivals.popleft()

    def summary(self, now_sec: float) -> BandwidthSummary | None:
        """Return what the window says; None while there is no message, or no time has passed."""
        if not self._arrivals or now_sec <= self._arrivals[0][0]:
            return None
        total = sum(sum(sizes) for _, sizes in self._arrivals)
        return BandwidthSummary(
            bytes_per_sec=total / (now_sec - self._arrivals[0][0]),
            messages=self._count,
            mean_bytes=total / self._count,
            min_bytes=min(min(sizes) for _, sizes in self._arrivals),
            max_bytes=max(max(sizes) for _, sizes in self._arrivals),
        )


class DelaySummary(NamedTuple):
    """How old messages are when they come.

    Attributes:
        mean_sec, min_sec, max_sec: Their age. Below zero: the sender's clock is ahead of ours.
        deviation_sec: Its standard deviation.
        window: Messages in the window.
    """

    mean_sec: float
    min_sec: float
    max_sec: float
    deviation_sec: float
    window: int


class Delay:
    """How old messages are when they come.

    Args:
        window: The messages to look back on, 1 or more.
    """

    def __init__(self, window: int = RATE_WINDOW) -> None:
        self._ages: deque[float] = deque(maxlen=max(1, window))

    def add(self, age_sec: float) -> None:
        """A message of this age has come."""
        self._ages.append(age_sec)

    def summary(self) -> DelaySummary | None:
        """Return what the window says; None while there is no message."""
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
    """How often messages come, by a counter.

    Attributes:
        per_sec: Messages a second.
        window: Messages in the window.
    """

    per_sec: float
    window: int


class CountedTraffic(NamedTuple):
    """How many bytes come, by a counter.

    Attributes:
        bytes_per_sec: From the window's first look to the last.
        messages: Messages in between.
        mean_bytes: A message's size; 0 if there is none.
    """

    bytes_per_sec: float
    messages: int
    mean_bytes: float


class _Look(NamedTuple):
    time_sec: float
    messages: int
    size_bytes: int


class CounterRate:
    """How often messages come, by looks at a counter. Nothing has to be heard for that.

    What came between two looks came at an unknown time in between. A rate is therefore taken from one rise of
    the counter to another: its error is the time between two looks, over the time that the window spans.

    Args:
        window: The messages to look back on, 2 or more; about, for a look may find many.
        least_sec: The time to look back on at least.
    """

    def __init__(self, window: int = RATE_WINDOW, *, least_sec: float = LEAST_SEC) -> None:
        self._window = max(2, window)
        self._least_sec = least_sec
        self._begin: _Look | None = None
        """The first look, as long as the window reaches back to it."""
        self._rises: deque[_Look] = deque()
        """Looks that found more than the one before."""
        self._last: _Look | None = None

    def look(self, time_sec: float, messages: int, size_bytes: int) -> None:
        """Take in the counters as they are at a time. Where they have fallen, they have begun anew.

        Args:
            time_sec: Not before the last one.
            messages: In all, so far.
            size_bytes: Their size.
        """
        before, now = self._last, _Look(time_sec, messages, size_bytes)
        if before is not None and messages < before.messages:
            self._rises.clear()
            before = self._begin = _Look(time_sec, 0, 0)
        self._last = now
        if before is None:
            self._begin = now
        elif messages > before.messages:
            self._rises.append(now)
            while len(self._rises) > 2 and self._enough_since(self._rises[1]):
                self._rises.popleft()
                self._begin = None

    def _enough_since(self, earlier: _Look) -> bool:
        last = self._rises[-1]
        return (
            last.messages - earlier.messages >= self._window
            and last.time_sec - earlier.time_sec >= self._least_sec
        )

    @property
    def begun(self) -> bool:
        """Whether there has been a look."""
        return self._last is not None

    @property
    def total(self) -> int:
        """Messages at the last look."""
        return 0 if self._last is None else self._last.messages

    def rate(self) -> CountedRate | None:
        """Return how often messages came between two rises; None before there are two."""
        if len(self._rises) < 2:
            return None
        first, last = self._rises[0], self._rises[-1]
        if last.time_sec <= first.time_sec:
            return None
        messages = last.messages - first.messages
        return CountedRate(messages / (last.time_sec - first.time_sec), messages + 1)

    def traffic(self) -> CountedTraffic | None:
        """Return what came from the window's first look to the last; None before time has passed."""
        first, last = self._begin or (self._rises[0] if self._rises else None), self._last
        if first is None or last is None or last.time_sec <= first.time_sec:
            return None
        messages, size_bytes = last.messages - first.messages, last.size_bytes - first.size_bytes
        return CountedTraffic(
            bytes_per_sec=size_bytes / (last.time_sec - first.time_sec),
            messages=messages,
            mean_bytes=size_bytes / messages if messages else 0.0,
        )
