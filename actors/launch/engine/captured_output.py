"""Captured output: what nodes that run in the launch's process log and print, told as that of a process.

A node's task has its `CapturedOutput` in its context, and so has all that it starts. `captured_logs` and
`captured_streams` find it there.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from contextlib import suppress
from contextvars import ContextVar
from itertools import groupby
from typing import TYPE_CHECKING, Final

from actors.launch.engine.lines import Lines
from actors.launch.planning.events import Level, Stream

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from contextvars import Context

MAX_WAITING_BYTES: Final = 1024 * 1024
"""What one node may write while it holds the loop. Lines beyond it are dropped, and counted."""

_captured: ContextVar[CapturedOutput | None] = ContextVar("callboard_launch_voice", default=None)


class CapturedOutput:
    """What one node writes. Lines are told from the loop a little later, in the context of the launch.

    So nothing that listens runs within the node's code, and a thread can write, too.

    Args:
        write: Takes its lines; when it has ended all of them have come.
        say: Takes what there is to say of it.
        context: The launch's.
        colored: Whether its lines may have colours.

    Attributes:
        colored: The same.
        over: Whether the node has ended.
        lost_lines: Lines dropped because too much waited.
    """

    def __init__(
        self,
        *,
        write: Callable[[Stream, Sequence[bytes]], None],
        say: Callable[[Level, str], None],
        context: Context,
        colored: bool,
    ) -> None:
        self.colored = colored
        self.over = False
        self.lost_lines = 0
        self._write = write
        self._say = say
        self._context = context
        self._loop = asyncio.get_running_loop()
        self._lines = {Stream.STDOUT: Lines(), Stream.STDERR: Lines()}
        self._waiting: deque[tuple[Stream, bytes]] = deque()
        self._waiting_bytes = 0
        self._untold = 0
        self._due = False
        # A destructor may write while something is being written.
        self._lock = threading.RLock()

    @staticmethod
    def current() -> CapturedOutput | None:
        """Return that of the node that runs now; None if none does, or it has ended."""
        captured = _captured.get()
        return None if captured is None or captured.over else captured

    def capture(self) -> None:
        """Capture the output of all that runs in this context from now on."""
        _captured.set(self)

    def write(self, stream: Stream, data: bytes) -> None:
        """Write something. A line is told when it is whole."""
        with self._lock:
            self._add(stream, self._lines[stream].feed(data))
            call = not self._due and bool(self._waiting or self._untold)
            self._due = self._due or call
        if call:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._flush, context=self._context)

    def end(self) -> None:
        """The node has ended: tell what there is, also lines without an end."""
        with self._lock:
            self.over = True
            for stream, lines in self._lines.items():
                self._add(stream, lines.end())
        self._context.run(self._flush)

    def _add(self, stream: Stream, lines: Iterable[bytes]) -> None:
        for line in lines:
            if self._waiting_bytes + len(line) >= MAX_WAITING_BYTES:
                self.lost_lines += 1
                self._untold += 1
            else:
                self._waiting.append((stream, line))
                self._waiting_bytes += len(line) + 1

    def _flush(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
            lost, self._untold = self._untold, 0
            self._waiting_bytes = 0
            self._due = False
        for stream, lines in groupby(waiting, key=lambda each: each[0]):
            self._write(stream, [line for _, line in lines])
        if lost:
            self._say(Level.WARN, f"node has written too fast: {lost} lines are not shown")
