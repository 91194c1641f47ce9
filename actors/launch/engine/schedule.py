"""Callbacks that are due at a time."""

from __future__ import annotations

import heapq
from itertools import count
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Callback: TypeAlias = Callable[[float], None]
    """Called with the current time."""


class Schedule:
    """Callbacks ordered by time; those for the same time in the order in which they were added.

    Attributes:
        keeping_alive: Number of callbacks for which a launch goes on although no process runs.
    """

    def __init__(self) -> None:
        self.keeping_alive = 0
        self._entries: list[tuple[float, int, bool, Callback]] = []
        self._numbers = count()

    @property
    def next_at(self) -> float | None:
        """When the next callback is due; None if there is none."""
        return self._entries[0][0] if self._entries else None

    def add(self, due: float, callback: Callback, *, keep_alive: bool = False) -> None:
        """Add a callback.

        Args:
            due: When to call it.
            callback: The callback.
            keep_alive: Whether the launch goes on for it, although no process runs.
        """
        self.keeping_alive += keep_alive
        # The number decides between equal times; callbacks cannot be compared.
        heapq.heappush(self._entries, (due, next(self._numbers), keep_alive, callback))

    def due(self, now: float) -> Iterator[Callback]:
        """Remove and yield the callbacks that are due, also those that are added meanwhile."""
        # One by one: a callback may end the launch, which clears the rest.
        while self._entries and self._entries[0][0] <= now:
            _, _, keep_alive, callback = heapq.heappop(self._entries)
            self.keeping_alive -= keep_alive
            yield callback

    def clear(self) -> None:
        """Remove all callbacks."""
        self._entries.clear()
        self.keeping_alive = 0
