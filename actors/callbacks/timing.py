"""Measure how long each callback of a node blocks the event loop, and warn about slow ones.

The unit is a *step*: what runs before the event loop can do other work. A step of plain callbacks is one
dispatch, which may be many messages; a step of a coroutine is what runs between two awaits. Time spent
waiting does not count.
"""

from __future__ import annotations

import inspect
import math
import time
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.functions import name_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.diagnostics.records import CallbackDiagnostics

SLOW_CALLBACK_SEC: Final = 0.1
"""Default duration above which a step is reported, because everything else on the loop waits for it."""

QUIET_SEC: Final = 10.0
"""Seconds between two reports about one callback. Slow steps in between are counted, not reported."""


class Stopwatch:
    """Measures the callbacks of one node.

    Args:
        warn: Called with a line about a slow step.
        slow_sec: A longer step is slow; None: no step is.
        clock: A monotonic clock, in seconds. Only reports depend on it, no decisions.
    """

    def __init__(
        self,
        warn: Callable[[str], object],
        *,
        slow_sec: float | None = SLOW_CALLBACK_SEC,
        clock: Callable[[], float] | None = None,
    ) -> None:
        if slow_sec is not None and not slow_sec >= 0:
            raise ValueError(f"slow_callback_sec must be zero or more seconds or None, got {slow_sec}")
        self.warn = warn
        self.slow_sec = math.inf if slow_sec is None else slow_sec
        self.clock = clock or time.perf_counter
        self._began = self.clock()

    def of(self, callback: Callable[..., Any] | None, whose: str, named: str = "") -> CallbackTiming:
        """Return a timing for a callback.

        Args:
            callback: The callback; None if the owner has none.
            whose: The kind of its owner, for messages, such as "the service".
            named: The owner's name, such as "/add".
        """
        name = "" if callback is None else name_of(callback)
        return CallbackTiming(self, name, whose, named, only_steps=inspect.iscoroutinefunction(callback))

    @property
    def elapsed_sec(self) -> float:
        """Seconds since the stopwatch was created."""
        return self.clock() - self._began


class CallbackTiming:
    """The measurements of one callback.

    Attributes:
        name: The callback's name.
        only_steps: Whether it is an `async def`: then its steps are measured, not the call that creates it.
        busy_sec: Seconds for which it has blocked the loop, in total.
        longest_sec: The longest step.
        longest_elapsed_sec: For coroutines, the longest time from start to end, waiting included.
        slow: The number of slow steps.
    """

    __slots__ = (
        "_calls",
        "_named",
        "_quiet_until",
        "_watch",
        "_whose",
        "busy_sec",
        "longest_elapsed_sec",
        "longest_sec",
        "name",
        "only_steps",
        "slow",
    )

    def __init__(self, watch: Stopwatch, name: str, whose: str, named: str = "", *, only_steps: bool) -> None:
        self.name = name
        self._whose = whose
        self._named = named
        self.only_steps = only_steps
        self.slow = 0
        self._calls = 0
        self.busy_sec = self.longest_sec = self.longest_elapsed_sec = 0.0
        self._watch = watch
        self._quiet_until = -math.inf

    @property
    def what(self) -> str:
        """The callback and its owner, for messages; only the owner if that has no callback."""
        callback = f"Callback {self.name} of " if self.name else ""
        named = f" '{self._named}'" if self._named else ""
        return f"{callback}{self._whose}{named}"

    def dispatched(self, seconds: float, calls: int) -> None:
        """Count a dispatch after which the callback has been called `calls` times in total."""
        # For an `async def` the dispatch only creates the coroutine; `stepped` measures what it does.
        if self.only_steps:
            return
        # Callbacks are counted once, by their source. The number in this dispatch is the difference, which
        # spares the hot path a second counter.
        count, self._calls = calls - self._calls, calls
        self.busy_sec += seconds
        if seconds > self.longest_sec:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            self.longest_sec = seconds
        if seconds > self._watch.slow_sec:
            self._report(seconds, count)

    def stepped(self, seconds: float, elapsed: float) -> None:
        """Count a step of a coroutine that ended `elapsed` seconds after the coroutine began."""
        self.busy_sec += seconds
        if seconds > self.longest_sec:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            self.longest_sec = seconds
        if elapsed > self.longest_elapsed_sec:  # noqa: PLR1730
            self.longest_elapsed_sec = elapsed
        if seconds > self._watch.slow_sec:
            self._report(seconds, 1)

    def diagnostics(self, calls: int) -> CallbackDiagnostics:
        """Return the measurements; the callback has been called `calls` times in total."""
        from actors.diagnostics.records import CallbackDiagnostics  # noqa: PLC0415 - seldom needed

        return CallbackDiagnostics(
            name=self.name,
            calls=calls,
            busy_sec=self.busy_sec,
            longest_sec=self.longest_sec,
            longest_elapsed_sec=self.longest_elapsed_sec,
            slow=self.slow,
        )

    def _report(self, seconds: float, count: int) -> None:
        self.slow += 1
        now = self._watch.clock()
        # A callback that is always slow would otherwise fill the log (and `/rosout`) with one line for each
        # message.
        if now < self._quiet_until:
            return
        self._quiet_until = now + QUIET_SEC
        batch = f" with {count} calls in a row" if count > 1 else ""
        self._watch.warn(
            f"{self.what} held the event loop for {seconds:.3f} s{batch}; nothing else on it ran meanwhile."
            " Long work belongs in a thread: await asyncio.to_thread(...)"
        )
