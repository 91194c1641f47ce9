"""Captured output: what nodes in the launch's own process log and print, reported as output of a process.

The task of such a node has its `CapturedOutput` in its context, and so has everything that it starts. A log
handler and replacements for `sys.stdout` and `sys.stderr` find it there.
"""

from __future__ import annotations

import asyncio
import io
import logging
import sys
import threading
from abc import abstractmethod
from collections import deque
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from itertools import groupby
from typing import TYPE_CHECKING, Final

from actors.launch.engine.lines import LineSplitter
from actors.launch.planning.events import Level, Message, Stream
from actors.logging.output import RosFormatter
from actors.logging.severity import ROOT_NAME
from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Sequence
    from contextvars import Context
    from typing import TextIO

    from _typeshed import ReadableBuffer

    from actors.launch.planning.events import Listener

MAX_WAITING_BYTES: Final = 1024 * 1024
"""What one node may write while it holds the loop. Lines beyond it are dropped, and counted."""

_captured: ContextVar[CapturedOutput | None] = ContextVar("callboard_launch_output", default=None)


class CapturedOutput:
    """The output of one node. Lines are passed on in the event loop a little later, in the launch's context.

    So no listener runs within the node's code, and threads can write, too.

    Args:
        write: Takes its lines; when it has ended all of them have come.
        on_message: Called with the level and text of each message about it.
        context: The launch's.
        colored: Whether its lines may have colours.

    Attributes:
        colored: The same.
        ended: Whether the node has ended.
        lost_lines: Lines dropped because too much waited.
    """

    def __init__(
        self,
        *,
        write: Callable[[Stream, Sequence[bytes]], None],
        on_message: Callable[[Level, str], None],
        context: Context,
        colored: bool,
    ) -> None:
        self.colored = colored
        self.ended = False
        self.lost_lines = 0
        self._write = write
        self._on_message = on_message
        self._context = context
        self._loop = asyncio.get_running_loop()
        self._lines = {Stream.STDOUT: LineSplitter(), Stream.STDERR: LineSplitter()}
        self._waiting: deque[tuple[Stream, bytes]] = deque()
        self._waiting_bytes = 0
        self._unreported_lines = 0
        self._due = False
        # A destructor may write while something is being written.
        self._lock = threading.RLock()

    @staticmethod
    def current() -> CapturedOutput | None:
        """Return that of the node that runs now; None if none does, or it has ended."""
        captured = _captured.get()
        return None if captured is None or captured.ended else captured

    def capture(self) -> None:
        """Capture the output of all that runs in this context from now on."""
        _captured.set(self)

    def write(self, stream: Stream, data: bytes) -> None:
        """Write bytes. A line is passed on when it is complete."""
        with self._lock:
            self._add(stream, self._lines[stream].feed(data))
            call = not self._due and bool(self._waiting or self._unreported_lines)
            self._due = self._due or call
        if call:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._flush, context=self._context)

    def end(self) -> None:
        """Pass on all lines, also an incomplete one: the node has ended."""
        with self._lock:
            self.ended = True
            for stream, lines in self._lines.items():
                self._add(stream, lines.end())
        self._context.run(self._flush)

    def _add(self, stream: Stream, lines: Iterable[bytes]) -> None:
        for line in lines:
            if self._waiting_bytes + len(line) >= MAX_WAITING_BYTES:
                self.lost_lines += 1
                self._unreported_lines += 1
            else:
                self._waiting.append((stream, line))
                self._waiting_bytes += len(line) + 1

    def _flush(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
            lost, self._unreported_lines = self._unreported_lines, 0
            self._waiting_bytes = 0
            self._due = False
        for stream, lines in groupby(waiting, key=lambda each: each[0]):
            self._write(stream, [line for _, line in lines])
        if lost:
            self._on_message(Level.WARN, f"node has written too fast: {lost} lines are not shown")


@contextmanager
def captured_logs() -> Generator[None]:
    """Meanwhile write what nodes in this process log to their stderr, as scripts do."""
    with _added(_CapturedLogs()):
        yield


@contextmanager
def launch_logs(notify: Listener) -> Generator[None]:
    """Meanwhile report what others log in this process as messages, in the event loop."""
    with _added(_LaunchLogs(notify)):
        yield


class _Handler(logging.Handler):
    """A log handler that reports its own errors in the way of the logging package."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self.take(record)
        except Exception:  # noqa: BLE001 - a log call must not fail
            self.handleError(record)

    @abstractmethod
    def take(self, record: logging.LogRecord) -> None: ...


class _CapturedLogs(_Handler):
    def __init__(self) -> None:
        super().__init__()
        self._plain, self._colored = RosFormatter(), RosFormatter(color=True)

    def take(self, record: logging.LogRecord) -> None:
        captured = CapturedOutput.current()
        if captured is not None:
            line = (self._colored if captured.colored else self._plain).format(record)
            captured.write(Stream.STDERR, f"{line}\n".encode(errors="backslashreplace"))


class _LaunchLogs(_Handler):
    def __init__(self, notify: Listener) -> None:
        super().__init__()
        self._notify = notify
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()

    def take(self, record: logging.LogRecord) -> None:
        if CapturedOutput.current() is not None:
            return
        message = _message(record)
        if threading.get_ident() == self._thread:
            self._notify(message)
        else:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._notify, message)


@contextmanager
def _added(handler: logging.Handler) -> Generator[None]:
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)


def _message(record: logging.LogRecord) -> Message:
    level = Level.INFO
    if record.levelno >= logging.WARNING:
        level = Level.ERROR if record.levelno >= logging.ERROR else Level.WARN
    text = escape(record.getMessage())
    if record.exc_info:
        traceback = logging.Formatter().formatException(record.exc_info)
        text = "\n".join([text, *map(escape, traceback.split("\n"))])
    return Message(level, text, record.name.removeprefix(f"{ROOT_NAME}."))


class _CapturedStream(io.RawIOBase):
    """Passes bytes on as output of the node that runs now, or as unattributed output."""

    def __init__(
        self, stream: Stream, original: TextIO, unattributed: Callable[[Stream, bytes], None] | None
    ) -> None:
        super().__init__()
        self._stream = stream
        self._original = original
        self._unattributed = unattributed

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return CapturedOutput.current() is None and self._original.isatty()

    def fileno(self) -> int:
        return self._original.fileno()

    def write(self, data: ReadableBuffer, /) -> int:
        content = bytes(data)
        captured = CapturedOutput.current()
        if captured is not None:
            captured.write(self._stream, content)
        elif self._unattributed is not None:
            self._unattributed(self._stream, content)
        else:
            self._original.write(content.decode(errors="backslashreplace"))
            self._original.flush()
        return len(content)


@contextmanager
def captured_streams(unattributed: Callable[[Stream, bytes], None] | None = None) -> Generator[None]:
    """Have such streams meanwhile. They hold for the whole process.

    Args:
        unattributed: Takes what others print, from any thread, and must not wait; None: the streams before.
    """
    before = sys.stdout, sys.stderr
    sys.stdout = _text(Stream.STDOUT, before[0], unattributed)
    sys.stderr = _text(Stream.STDERR, before[1], unattributed)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _text(stream: Stream, original: TextIO, unattributed: Callable[[Stream, bytes], None] | None) -> TextIO:
    raw = _CapturedStream(stream, original, unattributed)
    # Unbuffered, so that a text is written in the context of whoever prints it.
    return io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", newline="", write_through=True)  # type: ignore[type-var]


class _SharedCapture:
    """Captures logs and streams, which belong to the whole process, while anybody needs them captured."""

    def __init__(self) -> None:
        self._users = 0
        self._installed = ExitStack()

    @contextmanager
    def __call__(self) -> Generator[None]:
        """Meanwhile capture what nodes in this process log and print. It can be entered many times."""
        if not self._users:
            self._installed.enter_context(captured_logs())
            self._installed.enter_context(captured_streams())
        self._users += 1
        try:
            yield
        finally:
            self._users -= 1
            if not self._users:
                self._installed.close()


captured_nodes: Final = _SharedCapture()
