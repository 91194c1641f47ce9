"""Write lines to a terminal, a pipe or files in a thread, so that the event loop never waits for a reader.

A stopped terminal, an unread pipe or a hanging disk must not delay the processes of a launch, nor stopping
them. So writers add to a bounded queue; what exceeds the limit is dropped, counted and reported.
"""

from __future__ import annotations

import errno
import os
import select
import threading
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from actors.launch.engine.lines import LineSplitter

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.launch.planning.events import Stream

MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""Some seconds of the fastest output, and little beside the memory of the processes that write it."""
BATCH_BYTES: Final = 65_536
"""Size of a batch, unless a single item is larger."""

_PIECE_BYTES: Final = 65_536
_ERASE: Final = b"\r\x1b[K"
_DEFAULT_COLUMNS: Final = 80
_DISK_FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})

T = TypeVar("T")


@dataclass(frozen=True)
class Batch(Generic[T]):
    """The next work of a writer thread.

    Attributes:
        items: To be written; empty if the thread was only woken.
        lost_lines: Number of dropped lines that have not been reported; set only when the queue is empty, so
            that the report follows the lines before the gap.
        last: Whether no batch follows.
    """

    items: tuple[T, ...] = ()
    lost_lines: int = 0
    last: bool = False


class WriteQueue(Generic[T]):
    """Queue between an event loop and its writer thread. `add` never blocks.

    Attributes:
        lost_lines: Number of lines dropped because the queue was full or has been abandoned.
    """

    def __init__(self) -> None:
        self.lost_lines = 0
        self._items: deque[tuple[T, int, int]] = deque()
        self._queued_bytes = 0
        self._unreported_lines = 0
        self._woken = False
        self._ended = False
        self._abandoned = False
        self._changed = threading.Condition()

    def add(self, item: T, size_bytes: int, lines: int) -> None:
        """Append an item, or drop it and count its lines if the queue is full, ended or abandoned.

        Args:
            item: The item.
            size_bytes: Its size.
            lines: How many lines are lost if it is dropped.
        """
        with self._changed:
            # The newest lines are dropped: the older ones may be half written already.
            if self._abandoned or self._ended or self._queued_bytes + size_bytes > MAX_QUEUED_BYTES:
                self.lost_lines += lines
                self._unreported_lines += lines
                return
            self._items.append((item, size_bytes, lines))
            self._queued_bytes += size_bytes
            self._changed.notify()

    def wake(self) -> None:
        """Make `next_batch` return, with an empty batch if nothing is queued."""
        with self._changed:
            self._woken = True
            self._changed.notify()

    def end(self) -> None:
        """Let `next_batch` return a last batch after the queued items."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def abandon(self) -> None:
        """Drop queued and future items: nothing can be written any more."""
        with self._changed:
            self._abandoned = True
            self.lost_lines += sum(lines for _, _, lines in self._items)
            self._items.clear()
            self._queued_bytes = 0

    def next_batch(self) -> Batch[T]:
        """Wait for work and return it. Only the writer thread calls this."""
        with self._changed:
            while not (self._items or self._unreported_lines or self._woken or self._ended):
                self._changed.wait()
            self._woken = False
            if self._items:
                return Batch(tuple(self._pop_items()))
            lost, self._unreported_lines = self._unreported_lines, 0
            return Batch(lost_lines=lost, last=self._ended and not lost)

    def _pop_items(self) -> list[T]:
        items: list[T] = []
        size = 0
        while self._items and size < BATCH_BYTES:
            item, length, _ = self._items.popleft()
            items.append(item)
            size += length
        self._queued_bytes -= size
        return items


class OutputWriter:
    """Writes bytes to a file descriptor, in order, in its own thread.

    On a terminal it can keep a status line below all others, which is erased and drawn again once per batch,
    so that it costs nothing per line. While a disk is full, lines are dropped and counted.

    Args:
        descriptor: The file descriptor; it is not closed.
        on_closed: Called once, in the thread, when the reader has closed its end. Later lines are dropped.
        format_lost: Returns the line that reports a number of lost lines; None: a human-readable one.
        on_disk_full: Called once, in the thread, when the disk is full.

    Attributes:
        unwritten_lines: Number of lines dropped because the disk was full.
    """

    def __init__(
        self,
        descriptor: int,
        on_closed: Callable[[], None],
        format_lost: Callable[[int], bytes] | None = None,
        on_disk_full: Callable[[OSError], None] | None = None,
    ) -> None:
        self.unwritten_lines = 0
        self._descriptor = descriptor
        self._on_closed = on_closed
        self._format_lost = format_lost or _format_lost
        self._on_disk_full = on_disk_full
        self._in_line = False
        self._queue: WriteQueue[bytes] = WriteQueue()
        self._draw: Callable[[int], bytes] | None = None
        self._drawn = b""
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="launch output", daemon=True)
        self._thread.start()

    @property
    def lost_lines(self) -> int:
        """Number of lines dropped: the queue or the disk was full, or the reader is gone."""
        return self._queue.lost_lines + self.unwritten_lines

    def write(self, data: bytes) -> None:
        """Queue whole lines. Returns at once."""
        if data:
            self._queue.add(data, len(data), data.count(b"\n"))

    def set_status_line(self, draw: Callable[[int], bytes]) -> None:
        """Show a line below all others, in place of the one that is there. For terminals.

        Args:
            draw: Called in the thread with a number of columns; returns a line that is not wider, or nothing
                for no line.
        """
        self._draw = draw
        self._queue.wake()

    def close(self, timeout_sec: float) -> bool:
        """Write the queued lines; later ones are dropped.

        Args:
            timeout_sec: How long to wait for that.

        Returns:
            Whether all of them have been written.
        """
        self._queue.end()
        self._thread.join(timeout_sec)
        return not (self._thread.is_alive() or self._closed or self.unwritten_lines)

    def _run(self) -> None:
        try:
            while not (batch := self._queue.next_batch()).last:
                data = b"".join(batch.items)
                self._write_above_status(
                    data + self._format_lost(batch.lost_lines) if batch.lost_lines else data
                )
            self._draw = None
            self._write_above_status(b"")
        except OSError:
            self._closed = True
            self._queue.abandon()
            self._on_closed()

    def _write_above_status(self, data: bytes) -> None:
        line = self._draw(self._columns()) if self._draw is not None else b""
        if not data and line == self._drawn:
            return
        erase = _ERASE if self._drawn else b""
        self._drawn = line
        try:
            self._write_all(erase + data + line)
        except OSError as error:
            if error.errno not in _DISK_FULL:
                raise
            self.unwritten_lines += data.count(b"\n")
            if self._on_disk_full is not None:
                self._on_disk_full(error)
                self._on_disk_full = None

    def _columns(self) -> int:
        try:
            return os.get_terminal_size(self._descriptor).columns or _DEFAULT_COLUMNS
        except OSError:
            return _DEFAULT_COLUMNS

    def _write_all(self, data: bytes) -> None:
        rest = memoryview(b"\n" + data if self._in_line else data)
        while rest:
            try:
                rest = rest[os.write(self._descriptor, rest[:_PIECE_BYTES]) :]
                # A full disk can take half a line; the next line must not continue that one.
                self._in_line = bool(rest)
            except BlockingIOError:  # another program has made the terminal non-blocking
                select.select([], [self._descriptor], [])


class UnattributedOutput:
    """Splits what the launch's own process prints, but none of its nodes, into lines for each stream.

    Handlers, libraries and destructors print from any thread, and in the event loop: nothing here blocks.

    Args:
        writers: Called with whole lines of each stream; they must return at once.
    """

    def __init__(self, writers: Mapping[Stream, Callable[[bytes], None]]) -> None:
        self._writers = writers
        self._lines = {stream: LineSplitter() for stream in writers}
        # Reentrant: a destructor may print while something is being printed.
        self._lock = threading.RLock()

    def write(self, stream: Stream, data: bytes) -> None:
        """Pass on the lines that are complete now."""
        with self._lock:
            self._pass_on(stream, self._lines[stream].feed(data))

    def end(self) -> None:
        """Pass on lines without an end."""
        with self._lock:
            for stream, lines in self._lines.items():
                self._pass_on(stream, lines.end())

    def _pass_on(self, stream: Stream, lines: list[bytes]) -> None:
        if lines:
            self._writers[stream](b"".join(line + b"\n" for line in lines))


def _format_lost(lines: int) -> bytes:
    return b"[launch] %d lines are not shown: they came too fast\n" % lines
