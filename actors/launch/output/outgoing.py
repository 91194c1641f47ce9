"""What waits to be written by a thread: whoever adds to it never waits.

What waits has a limit; what is beyond it is dropped, and its lines are counted.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
BATCH_BYTES: Final = 65_536
"""What is taken at once, unless a single piece is larger."""

T = TypeVar("T")


@dataclass(frozen=True)
class Batch(Generic[T]):
    """What a thread is to do next.

    Attributes:
        pieces: To be written. Empty if there is something else to be done.
        lost_lines: Lines dropped that have not been reported; only when nothing waits any more.
        last: Nothing will come after this.
    """

    pieces: tuple[T, ...] = ()
    lost_lines: int = 0
    last: bool = False


class Outgoing(Generic[T]):
    """Pieces in order, on their way from a loop to the thread that writes them.

    Attributes:
        lost_lines: Lines dropped because too much waited, or because nothing can be written any more.
    """

    def __init__(self) -> None:
        self.lost_lines = 0
        self._waiting: deque[tuple[T, int, int]] = deque()
        self._waiting_bytes = 0
        self._untold = 0
        self._woken = False
        self._ended = False
        self._abandoned = False
        self._changed = threading.Condition()

    def add(self, piece: T, size_bytes: int, lines: int) -> None:
        """Let a piece wait, which has so many bytes and lines. Returns at once."""
        with self._changed:
            if self._abandoned or self._ended or self._waiting_bytes + size_bytes > MAX_WAITING_BYTES:
                self.lost_lines += lines
                self._untold += lines
                return
            self._waiting.append((piece, size_bytes, lines))
            self._waiting_bytes += size_bytes
            self._changed.notify()

    def wake(self) -> None:
        """Let the thread take a batch, even if that has nothing in it."""
        with self._changed:
            self._woken = True
            self._changed.notify()

    def end(self) -> None:
        """Nothing more will be added."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def abandon(self) -> None:
        """Drop what comes from now on, and what waits: it cannot be written any more."""
        with self._changed:
            self._abandoned = True
            self.lost_lines += sum(lines for _, _, lines in self._waiting)
            self._waiting.clear()
            self._waiting_bytes = 0

    def take(self) -> Batch[T]:
        """Wait for something to do and return it. For the one thread that writes."""
        with self._changed:
            while not (self._waiting or self._untold or self._woken or self._ended):
                self._changed.wait()
            self._woken = False
            if self._waiting:
                return Batch(tuple(self._pieces()))
            lost, self._untold = self._untold, 0
            return Batch(lost_lines=lost, last=self._ended and not lost)

    def _pieces(self) -> list[T]:
        pieces: list[T] = []
        size = 0
        while self._waiting and size < BATCH_BYTES:
            piece, length, _ = self._waiting.popleft()
            pieces.append(piece)
            size += length
        self._waiting_bytes -= size
        return pieces
