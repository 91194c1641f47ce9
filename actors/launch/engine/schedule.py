"""Callbacks that are due at a time."""

from __future__ import annotations

import heapq
from itertools import count
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Callback: TypeAlias = Callable[[float], None]
    """Called with the current time."""


class _Entry(NamedTuple):
    callback: Callback
    keep_alive: bool
    cancel_on_shutdown: bool


class Schedule:
    """Callbacks ordered by time; those for the same time in the order in which they were added.

    Attributes:
        keeping_alive: Number of callbacks for which a launch goes on although no process runs.
    """

    def __init__(self) -> None:
        self.keeping_alive = 0
        self._entries: list[tuple[float, int, _Entry]] = []
        self._numbers = count()

    @property
    def next_at(self) -> float | None:
        """When the next callback is due; None if there is none."""
        return self._entries[0][0] if self._entries else None

    def add(
        self, due: float, callback: Callback, *, keep_alive: bool = False, cancel_on_shutdown: bool = True
    ) -> None:
        """Add a callback.

        Args:
            due: When to call it.
            callback: The callback.
            keep_alive: Whether the launch goes on for it, although no process runs.
            cancel_on_shutdown: Whether `shut_down` removes it.
        """
        self.keeping_alive += keep_alive
        # The number decides between equal times; callbacks cannot be compared.
        heapq.heappush(
            self._entries, (due, next(self._numbers), _Entry(callback, keep_alive, cancel_on_shutdown))
        )

    def due(self, now: float) -> Iterator[Callback]:
        """Remove and yield the callbacks that are due, also those that are added meanwhile."""
        # One by one: a callback may end the launch, which clears the rest.
        while self._entries and self._entries[0][0] <= now:
            _, _, entry = heapq.heappop(self._entries)
            self.keeping_alive -= entry.keep_alive
            yield entry.callback

    def shut_down(self, *, force: bool = False) -> None:
        """Remove the callbacks that a shutdown cancels; by force, all of them."""
        self._entries = [] if force else [each for each in self._entries if not each[2].cancel_on_shutdown]
        heapq.heapify(self._entries)
        self.keeping_alive = sum(entry.keep_alive for _, _, entry in self._entries)
