"""The launch's output: whoever writes never waits, however slowly it is read.

A thread writes. The terminal may be stopped and a pipe not be read; the processes of the launch, and stopping
them, must not wait for that. So what waits has a limit, and what is beyond it is counted and reported.

On a terminal there may be a last line below all others. It is taken away and drawn again around each batch,
so that it costs nothing per line.
"""

from __future__ import annotations

import errno
import os
import select
import threading
from typing import TYPE_CHECKING, Final

from actors.launch.output.outgoing import Outgoing

if TYPE_CHECKING:
    from collections.abc import Callable

_PIECE_BYTES: Final = 65_536
_ERASE: Final = b"\r\x1b[K"
_USUAL_COLUMNS: Final = 80
_DISK_FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})


class Output:
    """Writes bytes to a file descriptor, in order, in a thread of its own.

    A disk may be full for a while: what cannot be written then is dropped and counted.

    Args:
        descriptor: Where to; it is not closed.
        when_unheard: Called in the thread, once, when it cannot be written any more: nobody reads it. What
            comes after that is dropped.
        of_lost: Returns what is written about a number of lost lines; None: a line for people.
        when_full: Called in the thread, once, when the disk is full.

    Attributes:
        unwritten_lines: Lines dropped because the disk was full.
    """

    def __init__(
        self,
        descriptor: int,
        when_unheard: Callable[[], None],
        of_lost: Callable[[int], bytes] | None = None,
        when_full: Callable[[OSError], None] | None = None,
    ) -> None:
        self.unwritten_lines = 0
        self._descriptor = descriptor
        self._when_unheard = when_unheard
        self._of_lost = of_lost or _text_of_lost
        self._when_full = when_full
        self._torn = False
        self._outgoing: Outgoing[bytes] = Outgoing()
        self._draw: Callable[[int], bytes] | None = None
        self._drawn = b""
        self._unheard = False
        self._thread = threading.Thread(target=self._run, name="launch output", daemon=True)
        self._thread.start()

    @property
    def lost_lines(self) -> int:
        """Lines dropped because too much waited, or the disk was full, or nobody reads."""
        return self._outgoing.lost_lines + self.unwritten_lines

    def write(self, data: bytes) -> None:
        """Write whole lines. Returns at once."""
        if data:
            self._outgoing.add(data, len(data), data.count(b"\n"))

    def show_below(self, draw: Callable[[int], bytes]) -> None:
        """Show a line below all others, in place of the one that is there. For terminals.

        Args:
            draw: Returns it for a number of columns, none wider; nothing for no line. Called in the thread.
        """
        self._draw = draw
        self._outgoing.wake()

    def close(self, timeout_sec: float) -> bool:
        """Write what waits; return whether that could be done in time. Nothing can be written after it."""
        self._outgoing.end()
        self._thread.join(timeout_sec)
        return not (self._thread.is_alive() or self._unheard or self.unwritten_lines)

    def _run(self) -> None:
        try:
            while not (batch := self._outgoing.take()).last:
                data = b"".join(batch.pieces)
                self._put_above(data + self._of_lost(batch.lost_lines) if batch.lost_lines else data)
            self._draw = None
            self._put_above(b"")
        except OSError:
            self._unheard = True
            self._outgoing.abandon()
            self._when_unheard()

    def _put_above(self, data: bytes) -> None:
        """Write lines, and draw the line that is below them. If the disk is full they are dropped."""
        line = self._draw(self._columns()) if self._draw is not None else b""
        if not data and line == self._drawn:
            return
        erase = _ERASE if self._drawn else b""
        self._drawn = line
        try:
            self._put(erase + data + line)
        except OSError as error:
            if error.errno not in _DISK_FULL:
                raise
            self.unwritten_lines += data.count(b"\n")
            if self._when_full is not None:
                self._when_full(error)
                self._when_full = None

    def _columns(self) -> int:
        try:
            return os.get_terminal_size(self._descriptor).columns or _USUAL_COLUMNS
        except OSError:
            return _USUAL_COLUMNS

    def _put(self, data: bytes) -> None:
        rest = memoryview(b"\n" + data if self._torn else data)
        while rest:
            try:
                rest = rest[os.write(self._descriptor, rest[:_PIECE_BYTES]) :]
                self._torn = bool(rest)  # if the disk is full
            except BlockingIOError:  # another program has made the terminal non-blocking
                select.select([], [self._descriptor], [])


def _text_of_lost(lines: int) -> bytes:
    return b"[launch] %d lines are not shown: they came too fast\n" % lines
