"""The schedule: what is to be done when."""

from __future__ import annotations

import heapq
from itertools import count
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Act: TypeAlias = Callable[[float], None]
    """Is called with the time when it is done."""


class Schedule:
    """Acts, each for a time; those for the same time in the order in which they came.

    Attributes:
        holding: How many of them a launch goes on for though nothing runs.
    """

    def __init__(self) -> None:
        self.holding = 0
        self._entries: list[tuple[float, int, bool, Act]] = []
        self._numbers = count()

    @property
    def next_at(self) -> float | None:
        """When the next one is due; None if there is none."""
        return self._entries[0][0] if self._entries else None

    def add(self, due: float, act: Act, *, holds: bool = False) -> None:
        """Do something then; `holds`: the launch goes on for it."""
        self.holding += holds
        heapq.heappush(self._entries, (due, next(self._numbers), holds, act))

    def due(self, now: float) -> Iterator[Act]:
        """Take out what is due, one by one; what is added meanwhile may be among it."""
        while self._entries and self._entries[0][0] <= now:
            _, _, holds, act = heapq.heappop(self._entries)
            self.holding -= holds
            yield act

    def clear(self) -> None:
        """Forget everything."""
        self._entries.clear()
        self.holding = 0
