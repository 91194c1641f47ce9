"""The launch's output: whoever writes never waits, however slowly it is read.

A thread writes. The terminal may be stopped and a pipe not be read; the processes of the launch, and stopping
them, must not wait for that. So what waits has a limit, and what is beyond it is counted and said.
"""

from __future__ import annotations

import os
import select
import threading
from collections import deque
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
_PIECE_BYTES: Final = 65_536


class Output:
    """Writes bytes to a file descriptor, in order, in a thread of its own.

    Args:
        descriptor: Where to; it is not closed.
        when_unheard: Called in the thread, once, when it cannot be written any more: nobody reads it. What
            comes after that is dropped.

    Attributes:
        lost_lines: Lines dropped because too much waited, or nobody reads.
    """

    def __init__(self, descriptor: int, when_unheard: Callable[[], None]) -> None:
        self.lost_lines = 0
        self._descriptor = descriptor
        self._when_unheard = when_unheard
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._untold = 0
        self._closed = False
        self._unheard = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="launch output", daemon=True)
        self._thread.start()

    def write(self, data: bytes) -> None:
        """Write whole lines. Returns at once."""
        if not data:
            return
        with self._changed:
            if self._unheard or self._waiting_bytes + len(data) > MAX_WAITING_BYTES:
                lines = data.count(b"\n")
                self.lost_lines += lines
                self._untold += lines
                return
            self._waiting.append(data)
            self._waiting_bytes += len(data)
            self._changed.notify()

    def close(self, timeout_sec: float) -> bool:
        """Write what waits; return whether that could be done in time. Nothing can be written after it."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout_sec)
        return not self._thread.is_alive() and not self._unheard

    def _run(self) -> None:
        while data := self._next():
            try:
                self._put(data)
            except OSError:
                with self._changed:
                    self._unheard = True
                    self._waiting.clear()
                    self._waiting_bytes = 0
                self._when_unheard()
                return

    def _next(self) -> bytes:
        """Return the next piece; nothing at the end."""
        with self._changed:
            while not self._waiting and not self._untold and not self._closed:
                self._changed.wait()
            if not self._waiting:
                lost, self._untold = self._untold, 0
                return f"[launch] {lost} lines are not shown: they came too fast\n".encode() if lost else b""
            data = self._waiting.popleft()
            self._waiting_bytes -= len(data)
            return data

    def _put(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[os.write(self._descriptor, rest[:_PIECE_BYTES]) :]
            except BlockingIOError:  # another program has made the terminal non-blocking
                select.select([], [self._descriptor], [])
