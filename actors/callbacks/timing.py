"""How long each callback of a node holds the loop, and who holds it too long.

What is timed is a *step*: what runs between two looks of the event loop at its other work. For plain
callbacks that is a dispatch, many messages together; for coroutines each stretch between two awaits. Time
spent waiting does not count.
"""

from __future__ import annotations

import inspect
import math
import time
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.functions import name_of
from actors.diagnostics.records import CallbackDiagnostics

if TYPE_CHECKING:
    from collections.abc import Callable

SLOW_CALLBACK_SEC: Final = 0.1
"""A step longer than this is reported, unless the node says otherwise: everything else waits meanwhile."""

QUIET_SEC: Final = 10.0
"""After a report about a callback the next one waits for this long. What is not reported is counted."""


class Stopwatch:
    """Times the callbacks of one node.

    Args:
        warn: Gets a line about each slow step.
        slow_sec: From when on a step is slow; None never.
        clock: Steady seconds. Durations are for people: no decision depends on them.
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

    def of(self, callback: Callable[..., Any] | None, whose: str) -> CallbackTiming:
        """Return the timing of a callback of `whose`: "the service '/add'". None is a callback not given."""
        name = "" if callback is None else name_of(callback)
        return CallbackTiming(self, name, whose, only_turns=inspect.iscoroutinefunction(callback))

    @property
    def elapsed_sec(self) -> float:
        """Seconds since it was made."""
        return self.clock() - self._began


class CallbackTiming:
    """What is known about one callback.

    Attributes:
        name: The callback's name.
        what: The callback and whose it is, for messages.
        only_turns: It is an `async def`: its steps count, calling it does not.
        busy_sec: Seconds for which it has held the loop, in all.
        longest_sec: The longest step.
        longest_elapsed_sec: For coroutines, the longest time since one began, waiting included.
        slow: Steps that were slow.
    """

    __slots__ = (
        "_calls",
        "_quiet_until",
        "_watch",
        "busy_sec",
        "longest_elapsed_sec",
        "longest_sec",
        "name",
        "only_turns",
        "slow",
        "what",
    )

    def __init__(self, watch: Stopwatch, name: str, whose: str, *, only_turns: bool) -> None:
        self.name = name
        self.what = f"Callback {name} of {whose}"
        self.only_turns = only_turns
        self.slow = 0
        self._calls = 0
        self.busy_sec = self.longest_sec = self.longest_elapsed_sec = 0.0
        self._watch = watch
        self._quiet_until = -math.inf

    def dispatched(self, seconds: float, calls: int) -> None:
        """A dispatch has ended; `calls` is how often the callback has been called so far, in all."""
        if self.only_turns:
            return
        count, self._calls = calls - self._calls, calls
        self.busy_sec += seconds
        if seconds > self.longest_sec:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            self.longest_sec = seconds
        if seconds > self._watch.slow_sec:
            self._report(seconds, count)

    def stepped(self, seconds: float, elapsed: float) -> None:
        """A coroutine has run to its next await, or to its end, `elapsed` seconds after it began."""
        self.busy_sec += seconds
        if seconds > self.longest_sec:  # noqa: PLR1730 - max() takes longer, and this is the hot path
            self.longest_sec = seconds
        if elapsed > self.longest_elapsed_sec:  # noqa: PLR1730
            self.longest_elapsed_sec = elapsed
        if seconds > self._watch.slow_sec:
            self._report(seconds, 1)

    def diagnostics(self, calls: int) -> CallbackDiagnostics:
        """Say what is known; `calls` is how often the callback has been called so far."""
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
        if now < self._quiet_until:
            return
        self._quiet_until = now + QUIET_SEC
        batch = f" with {count} calls in a row" if count > 1 else ""
        self._watch.warn(
            f"{self.what} held the event loop for {seconds:.3f} s{batch}; nothing else on it ran meanwhile."
            " Long work belongs in a thread: await asyncio.to_thread(...)"
        )
