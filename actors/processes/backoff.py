"""Growing delays before restarts."""

from __future__ import annotations

from typing import Final

SETTLED_BACKOFFS: Final = 2
"""A run of this many times the longest delay counts as stable: the next delay is the first one again."""


class Backoff:
    """Delays before restarts: each is longer than the one before, up to a limit.

    Args:
        first_sec: The first delay.
        longest_sec: The longest delay.
        factor: The ratio of a delay to the one before.
    """

    def __init__(self, first_sec: float, longest_sec: float, factor: float = 2.0) -> None:
        self._first_sec = first_sec
        self._longest_sec = longest_sec
        self._factor = factor
        self._next_sec = first_sec

    def next(self, lived_sec: float) -> float:
        """Return the delay before the next restart, after a run of `lived_sec`."""
        if lived_sec >= SETTLED_BACKOFFS * self._longest_sec:
            self.reset()
        delay = self._next_sec
        self._next_sec = min(delay * self._factor, self._longest_sec)
        return delay

    def reset(self) -> None:
        """Begin with the first delay again."""
        self._next_sec = self._first_sec
