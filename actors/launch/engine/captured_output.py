"""Captures what nodes in the launch's own process log and print, as output of a process.

The task of such a node has its `CapturedOutput` in its context, and so has everything that it starts. A log
handler and replacements for `sys.stdout` and `sys.stderr` find it there.

Python has one `sys.stdout` and one root logger for all code of the process. The context variable tells the
output of one node from that of another; a file descriptor could not.
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
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Sequence
    from contextvars import Context
    from typing import TextIO

    from _typeshed import ReadableBuffer

    from actors.launch.planning.events import Listener

MAX_WAITING_BYTES: Final = 1024 * 1024
"""Limit of what one node writes while it blocks the loop. Further lines are dropped and counted."""

_captured: ContextVar[CapturedOutput | None] = ContextVar("callboard_launch_output", default=None)


class CapturedOutput:
    """The output of one node.

    Its lines are passed on by a callback of the event loop, in the context of the launch. So listeners never
    run within the code of the node, and threads can write, too.

    Args:
        write: Called with lines of a stream; `end` passes on the last ones.
        on_message: Called with the level and text of messages about the output.
        context: The context of the launch.
        colored: Whether lines may have colours.

    Attributes:
        colored: As given.
        ended: Whether the node has ended.
        lost_lines: Number of lines dropped because too many waited.
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
        self._flush_scheduled = False
        # Reentrant: a destructor may write while something is being written.
        self._lock = threading.RLock()

    @staticmethod
    def current() -> CapturedOutput | None:
        """Return the output of the node whose code is running; None if there is none, or it has ended."""
        captured = _captured.get()
        return None if captured is None or captured.ended else captured

    def capture(self) -> None:
        """Capture the output of everything that runs in this context from now on."""
        _captured.set(self)

    def write(self, stream: Stream, data: bytes) -> None:
        """Write bytes. Lines are passed on when they are complete."""
        with self._lock:
            self._add(stream, self._lines[stream].feed(data))
            # One callback for all lines of this loop turn, not one for each.
            schedule = not self._flush_scheduled and bool(self._waiting or self._unreported_lines)
            self._flush_scheduled = self._flush_scheduled or schedule
        if schedule:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._flush, context=self._context)

    def end(self) -> None:
        """Pass on all lines, also incomplete ones, because the node has ended."""
        with self._lock:
            self.ended = True
            for stream, lines in self._lines.items():
                self._add(stream, lines.end())
        # At once, not in a callback: the last lines must be reported before the end of the node.
        self._context.run(self._flush)

    def _add(self, stream: Stream, lines: Iterable[bytes]) -> None:
        for line in lines:
            # A node that blocks the loop also blocks the flush, so its lines would fill the memory.
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
            self._flush_scheduled = False
        # Outside the lock: listeners may take long, and threads of the node go on writing.
        for stream, lines in groupby(waiting, key=lambda each: each[0]):
            self._write(stream, [line for _, line in lines])
        if lost:
            self._on_message(Level.WARN, f"node has written too fast: {lost} lines are not shown")


@contextmanager
def captured_logs() -> Generator[None]:
    """Within the context, write log records of nodes in this process to their stderr, as scripts do."""
    with _added(_CapturedLogs()):
        yield


@contextmanager
def launch_logs(notify: Listener) -> Generator[None]:
    """Within the context, report log records of other code in this process as messages, in the event loop."""
    with _added(_LaunchLogs(notify)):
        yield


class _Handler(logging.Handler):
    """A log handler that reports its own errors as the logging package does."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self.report(record)
        except Exception:  # noqa: BLE001 - a log call must not fail
            self.handleError(record)

    @abstractmethod
    def report(self, record: logging.LogRecord) -> None: ...


class _CapturedLogs(_Handler):
    def __init__(self) -> None:
        super().__init__()
        self._plain, self._colored = RosFormatter(), RosFormatter(color=True)

    def report(self, record: logging.LogRecord) -> None:
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

    def report(self, record: logging.LogRecord) -> None:
        if CapturedOutput.current() is not None:
            return  # `_CapturedLogs` writes it as output of its node
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
    level = Level.INFO if record.levelno >= logging.INFO else Level.DEBUG
    if record.levelno >= logging.WARNING:
        level = Level.ERROR if record.levelno >= logging.ERROR else Level.WARN
    text = escape(record.getMessage())
    if record.exc_info:
        traceback = logging.Formatter().formatException(record.exc_info)
        text = "\n".join([text, *map(escape, traceback.split("\n"))])
    return Message(level, text, record.name.removeprefix(f"{ROOT_NAME}."))


class _CapturedStream(io.RawIOBase):
    """Passes bytes on as output of the node whose code is running, or as unattributed output."""

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
        # The output of nodes gets labels and may be JSON: progress bars would spoil it.
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
    """Within the context, replace sys.stdout and sys.stderr of the whole process.

    Args:
        unattributed: Called in any thread with what code outside of nodes prints; must not block. None: it
            goes to the original streams.
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
    # Unbuffered, so that bytes are written in the context of the code that prints them.
    return io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", newline="", write_through=True)  # type: ignore[type-var]


class _SharedCapture:
    """Captures logs and streams, which belong to the whole process, while at least one user needs it."""

    def __init__(self) -> None:
        self._users = 0
        self._installed = ExitStack()

    @contextmanager
    def __call__(self) -> Generator[None]:
        """Within the context, capture what nodes in this process log and print. Contexts may overlap."""
        # Installed twice, each line would be reported twice.
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
