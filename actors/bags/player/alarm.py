"""Wakes the event loop when a message is due, to about a tenth of a millisecond.

The timers of event loops count whole milliseconds: intervals of 1 ms were off by up to 2 ms with them.
"""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

EXACT_NS: Final = 4_000_000
"""Longest wait of the thread. A longer one is the loop's, up to half of this before the time."""
WAKING_NS: Final = 50_000
"""About what it takes from the end of the thread's sleep until the loop runs."""


class Alarm:
    """Calls a function on the event loop after a wait.

    Args:
        ring: The function. It may also be called after `cancel`, by a few milliseconds.
    """

    def __init__(self, ring: Callable[[], object]) -> None:
        self._ring = ring
        self._loop = asyncio.get_running_loop()
        self._thread = ThreadPoolExecutor(1, "bag-alarm")
        self._timer: asyncio.TimerHandle | None = None

    def set(self, wait_ns: int) -> None:
        """Call the function after a wait, or earlier if the wait is long: it sets the alarm again then.

        Args:
            wait_ns: The wait in nanoseconds, above 0.
        """
        self.cancel()
        if wait_ns > EXACT_NS:
            self._timer = self._loop.call_later((wait_ns - EXACT_NS // 2) / 1e9, self._ring)
        else:
            self._thread.submit(self._sleep, time.monotonic_ns() + wait_ns - WAKING_NS)

    def _sleep(self, until_ns: int) -> None:
        time.sleep(max(0, until_ns - time.monotonic_ns()) / 1e9)
        with suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._ring)

    def cancel(self) -> None:
        """Do not call the function."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def close(self) -> None:
        """End the thread, within a few milliseconds."""
        self.cancel()
        self._thread.shutdown(wait=False)
