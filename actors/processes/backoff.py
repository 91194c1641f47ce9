"""How long to wait before something is started again."""

from __future__ import annotations

from typing import Final

SETTLED_BACKOFFS: Final = 2
"""What has lived this many times the longest delay is taken to be well again: delays begin anew."""


class Backoff:
    """Delays before restarts. Each is longer than the one before, up to the longest.

    Args:
        first_sec: The first delay.
        longest_sec: The longest one.
        factor: By what delays grow.
    """

    def __init__(self, first_sec: float, longest_sec: float, factor: float = 2.0) -> None:
        self._first_sec = first_sec
        self._longest_sec = longest_sec
        self._factor = factor
        self._next_sec = first_sec

    def next(self, lived_sec: float) -> float:
        """Return the delay after something has lived so long."""
        if lived_sec >= SETTLED_BACKOFFS * self._longest_sec:
            self.reset()
        delay = self._next_sec
        self._next_sec = min(delay * self._factor, self._longest_sec)
        return delay

    def reset(self) -> None:
        """Begin anew."""
        self._next_sec = self._first_sec
