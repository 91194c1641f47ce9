"""Many deadlines with one loop timer, which is set to the earliest."""

from __future__ import annotations

import asyncio
import heapq
import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

# Below this many dead entries, rebuilding the heap costs more than the memory is worth.
_SLACK: Final = 1024


class Deadlines:
    """Calls `expired` with each key whose deadline has passed.

    Removed keys are deleted lazily: the heap holds at most twice as many entries as there are live
    keys, plus a constant.
    """

    def __init__(self, expired: Callable[[int], None]) -> None:
        self._expired = expired
        self._heap: list[tuple[float, int]] = []
        self._live: dict[int, float] = {}
        self._timer: asyncio.TimerHandle | None = None

    def add(self, key: int, when: float) -> None:
        """Expire `key` at loop time `when`, unless it is removed before."""
        self._live[key] = when
        heapq.heappush(self._heap, (when, key))
        if self._timer is None or when < self._timer.when():
            self._arm()

    def remove(self, key: int) -> None:
        """Remove a deadline; unknown keys are ignored."""
        # The usual end of a deadline, since nearly every call is answered in time. So it must be cheap: the
        # heap entry stays until it is due, or until dead entries are the majority.
        self._live.pop(key, None)
        if len(self._heap) > 2 * len(self._live) + _SLACK:
            self._heap = [entry for entry in self._heap if entry[1] in self._live]
            heapq.heapify(self._heap)

    def get(self, key: int) -> float:
        """Return the loop time at which a key expires; infinity for an unknown one."""
        return self._live.get(key, math.inf)

    def clear(self) -> None:
        """Remove all deadlines."""
        self._live.clear()
        self._heap.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _arm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_at(self._heap[0][0], self._expire_due)

    def _expire_due(self) -> None:
        self._timer = None
        now = asyncio.get_running_loop().time()
        try:
            # Dead entries at the top go as well, or the loop would be woken for a deadline that nobody has.
            while self._heap and (self._heap[0][0] <= now or self._heap[0][1] not in self._live):
                _, key = heapq.heappop(self._heap)
                if key in self._live:
                    del self._live[key]
                    self._expired(key)
        finally:
            # Also if `expired` has raised. It may have added a deadline, too, which has set the timer
            # already.
            if self._heap and self._timer is None:
                self._arm()
