"""Log files of a launch: its messages, and the lines of processes whose output mode asks for it.

A thread writes, so that a slow or full disk does not block the launch. Lost lines are counted and reported.
"""

from __future__ import annotations

import re
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actors.launch.description.process_actions import OutputMode
from actors.launch.output.messages import message_for
from actors.launch.output.sanitize import has_controls, plain_line
from actors.launch.output.writer import WriteQueue
from actors.launch.planning.events import Level, Message, ProcessEvent, ProcessIO, Stream
from actors.logging.terminal_text import escape_controls

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.output.log_folder import LogFolder
    from actors.launch.planning.events import Event, Listener

LAUNCH_LOG: Final = "launch.log"

MAX_EARLY_LINES: Final = 1000
"""Messages kept before the first process that wants log files; of more, the latest."""

_TOGETHER: Final = frozenset({OutputMode.LOG, OutputMode.BOTH, OutputMode.FULL})
_APART: Final = frozenset({OutputMode.OWN_LOG, OutputMode.FULL})

_UNSAFE = re.compile(r"[^\w.-]|^\.")
_MAX_NAME_CHARACTERS: Final = 50


@dataclass(frozen=True)
class _Entry:
    """Lines, and the files that they are written to."""

    lines: int
    writes: tuple[tuple[str, bytes], ...]


class LogFiles:
    """A listener that writes log files, from the first process whose output mode asks for them.

    Args:
        open_folder: Called in the writer thread; returns the folder of this launch.
        notify: Called with messages about the folder and errors, also in the writer thread.
    """

    def __init__(self, open_folder: Callable[[], LogFolder], notify: Listener) -> None:
        self._open_folder = open_folder
        self._notify = notify
        self._early: deque[_Entry] = deque(maxlen=MAX_EARLY_LINES)
        self._queue: WriteQueue[_Entry] = WriteQueue()
        self._thread: threading.Thread | None = None
        self._folder: LogFolder | None = None
        self._unwritten = 0
        self._complained = False

    @property
    def lost_lines(self) -> int:
        """Number of lines that came too fast, or could not be written."""
        return self._queue.lost_lines + self._unwritten

    def __call__(self, event: Event) -> None:
        """Log an event."""
        if isinstance(event, ProcessEvent) and event.process.output in _TOGETHER | _APART:
            self._begin()
        if isinstance(event, ProcessIO):
            writes = tuple(_writes(event))
            if writes:
                self._add(_Entry(len(event.lines), writes))
        elif (message := message_for(event)) is not None:
            level, text = message.level.value, escape_controls(message.text)
            line = f"{_stamp()} [{level}] [{escape_controls(message.about)}]: {text}\n"
            self._add(_Entry(1, ((LAUNCH_LOG, line.encode(errors="backslashreplace")),)))

    def close(self, timeout_sec: float) -> bool:
        """Write the queued lines, report lost lines, and return whether none are lost."""
        if self._thread is None:
            return True
        self._queue.end()
        self._thread.join(timeout_sec)
        if self._thread.is_alive():
            self._notify(Message(Level.WARN, "the log files end early: they cannot be written fast enough"))
        elif self.lost_lines:
            self._notify(Message(Level.WARN, f"{self.lost_lines} lines are missing in the log files"))
        return not self._thread.is_alive() and not self.lost_lines

    def _begin(self) -> None:
        # A launch whose processes only write to the screen leaves no folder behind.
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="launch log files", daemon=True)
            self._thread.start()
            for entry in self._early:
                self._add(entry)
            self._early.clear()

    def _add(self, entry: _Entry) -> None:
        if self._thread is None:
            self._early.append(entry)
        else:
            self._queue.add(entry, sum(len(data) for _, data in entry.writes), entry.lines)

    # In the thread

    def _run(self) -> None:
        try:
            self._folder = self._open_folder()
        except OSError as error:
            self._complain(error)
        else:
            self._notify(Message(Level.INFO, f"log files are in {self._folder.path}"))
        while not (batch := self._queue.next_batch()).last:
            for entry in batch.items:
                self._write(entry)
            if batch.lost_lines:
                text = (
                    f"{_stamp()} [WARN] [launch]: {batch.lost_lines} lines are missing: they came too fast\n"
                )
                self._write(_Entry(0, ((LAUNCH_LOG, text.encode()),)))
        if self._folder is not None:
            self._folder.close()

    def _write(self, entry: _Entry) -> None:
        if self._folder is None:
            self._unwritten += entry.lines
            return
        try:
            for name, data in entry.writes:
                self._folder.write(name, data)
        except OSError as error:
            self._unwritten += entry.lines
            self._complain(error)

    def _complain(self, error: OSError) -> None:
        """Report once that files cannot be written; the launch goes on."""
        if not self._complained:
            self._complained = True
            where = self._folder.path if self._folder is not None else error.filename
            self._notify(
                Message(Level.ERROR, f"log files in {where} cannot be written: {error.strerror or error}")
            )


def _writes(event: ProcessIO) -> list[tuple[str, bytes]]:
    """Return the names of files and the bytes for each."""
    mode, label = event.process.output, event.process_name
    writes: list[tuple[str, bytes]] = []
    if mode in _TOGETHER:
        writes.append((LAUNCH_LOG, _plain(event, f"{_stamp()} [{escape_controls(label)}] ")))
    if mode in _APART:
        name, lines = _file_name(label), _plain(event)
        writes.append((f"{name}.log", lines))
        if event.stream is not Stream.OUTPUT:
            writes.append((f"{name}-{event.stream.value}.log", lines))
    return writes


def _plain(event: ProcessIO, begin: str = "") -> bytes:
    """Return the lines without colours and terminal controls, each with a prefix."""
    first = begin.encode(errors="backslashreplace")
    lines = map(plain_line, event.lines) if has_controls(b"".join(event.lines)) else event.lines
    return b"".join(first + line + b"\n" for line in lines)


def _file_name(label: str) -> str:
    """Return a label as part of a file's name; the number at its end, which no other has, stays."""
    return _UNSAFE.sub("_", label[-_MAX_NAME_CHARACTERS:])


def _stamp() -> str:
    now_ms = time.time_ns() // 1_000_000
    return f"{time.strftime('%Y-%m-%dT%H:%M:%S', time.gmtime(now_ms // 1000))}.{now_ms % 1000:03d}Z"
