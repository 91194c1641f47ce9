"""The output of `callboard launch`: lines or JSON, a status line, and log files."""

from __future__ import annotations

import os
import sys
import threading
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.config import environment
from actors.launch.output.json_report import JsonReport
from actors.launch.output.log_files import LogFiles
from actors.launch.output.screen import Screen
from actors.launch.output.status import Status
from actors.launch.output.writer import OutputWriter, UnattributedOutput
from actors.launch.planning.events import Stream

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.output.log_folder import LogFolder
    from actors.launch.output.status import StatusLine
    from actors.launch.planning.events import Event, Listener

LAST_LINES_SEC: Final = 2.0
"""How long the last lines may take, when nobody reads or a disk hangs."""


class Reports:
    """A listener that passes events on to all that show or write them.

    Args:
        open_log_folder: Returns the folder for log files; called in a thread when the first one is needed.
        json: Whether stdout gets JSON, and nothing else. What is printed then goes to stderr.
        on_closed: Called once, in a thread, when the reader of stdout has closed it.
        interactive: Whether to draw a status line on a terminal.

    Attributes:
        closed: Whether that has happened.
    """

    def __init__(
        self,
        open_log_folder: Callable[[], LogFolder],
        *,
        json: bool,
        on_closed: Callable[[], None],
        interactive: bool = True,
    ) -> None:
        self.closed = False
        self._on_closed = on_closed
        self._json = JsonReport(self._write) if json else None
        format_lost = None if self._json is None else self._json.format_lost
        self._errors: OutputWriter | None = None
        self._errors_lock = threading.RLock()
        self._output = OutputWriter(sys.stdout.fileno(), self._stdout_closed, format_lost, self._disk_full)
        stdout = self._write_error if json else self._write
        self._unattributed = UnattributedOutput({Stream.STDOUT: stdout, Stream.STDERR: self._write_error})
        shown: Listener = self._json or Screen(self._write, color=_color())
        self._logs = LogFiles(open_log_folder, shown)
        self._listeners: list[Listener] = [shown, self._logs]
        if interactive and self._json is None and sys.stdout.isatty() and not environment.dumb_terminal():
            # First, so that it is up to date when what has happened is shown.
            self._listeners.insert(0, Status(self._show_status))

    def __call__(self, event: Event) -> None:
        """Show and write an event."""
        for listener in self._listeners:
            listener(event)

    def printed(self, stream: Stream, data: bytes) -> None:
        """Show what is printed in this process, from any thread, but by none of its nodes."""
        self._unattributed.write(stream, data)

    def close(self, exit_code: int) -> None:
        """Write what is left. Nothing can be shown after it."""
        self._unattributed.end()
        self._logs.close(LAST_LINES_SEC)
        if self._json is not None:
            self._json.ended(exit_code)
        self._output.close(LAST_LINES_SEC)
        if self._output.unwritten_lines:
            missing = self._output.unwritten_lines
            self._write_error(b"[WARN] [launch]: %d lines are missing on stdout\n" % missing)
        if self._errors is not None:
            self._errors.close(LAST_LINES_SEC)

    def _write(self, data: bytes) -> None:
        self._output.write(data)

    def _write_error(self, data: bytes) -> None:
        """Write lines to stderr, for which nothing waits either."""
        with self._errors_lock:
            if self._errors is None:
                self._errors = OutputWriter(sys.stderr.fileno(), lambda: None)
        self._errors.write(data)

    def _disk_full(self, error: OSError) -> None:
        text = f"[ERROR] [launch]: stdout cannot be written: {os.strerror(error.errno or 0)}\n"
        self._write_error(text.encode(errors="backslashreplace"))

    def _stdout_closed(self) -> None:
        self.closed = True
        self._on_closed()

    def _show_status(self, line: StatusLine) -> None:
        self._output.set_status_line(partial(line.drawn, color=_color()))


def _color() -> bool:
    wish = environment.color_wish()
    return sys.stdout.isatty() if wish is None else wish
