"""The transcript of a launch: the output and the states of its processes.

It is bounded: beyond a limit the oldest lines are dropped, and counted. Searches see each line when it
arrives, so that they find lines that are dropped at once.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Final

from actors.launch.planning import events

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.processes.outcome import Outcome

MAX_LINES: Final = 10_000
MAX_BYTES: Final = 4 * 1024 * 1024
"""Total size of the kept lines."""
MAX_PROCESSES: Final = 2000
"""Twice what a launch may run at a time. Beyond it ended processes are forgotten."""
LAUNCH: Final = "launch"
"""The label of the launch's own lines."""


class ProcessState(Enum):
    """The state of a process of a launch."""

    WAITING = "waiting"
    """Its dependencies are not there yet."""
    RUNNING = "running"
    RESTARTING = "restarting"
    """It has ended and will be started again."""
    ENDED = "ended"


@dataclass(frozen=True, kw_only=True, slots=True)
class ProcessStatus:
    """A process of a launch at one moment.

    Attributes:
        label: Its name in the launch: "talker-1".
        name: The label without its number.
        node: The full name of its node, if the description contains it.
        state: Its state.
        pid: Its latest process id; None if it has none.
        restarts: How often it has been started again.
        exit_code: Its latest exit code, negative for a signal; None if it has not ended yet. A node in this
            process and a program that could not be run have 0 if they ended well, else 1.
        reason: The same in words: "exit code 1", "killed by SIGKILL".
        missing: Dependencies that are not there yet.
    """

    label: str
    name: str
    node: str | None = None
    state: ProcessState
    pid: int | None = None
    restarts: int = 0
    exit_code: int | None = None
    reason: str = ""
    missing: tuple[Presence, ...] = ()

    def is_called(self, name: str) -> bool:
        """Return whether a name identifies this process.

        Args:
            name: A label, a label without the number, or a node's full name.
        """
        return name in {self.label, self.name, self.node}

    def __str__(self) -> str:
        """Return a line such as "talker-1: running, pid 7"."""
        parts = [self.state.value]
        if self.state is ProcessState.WAITING and self.missing:
            parts[0] += f" for {' and '.join(map(str, self.missing))}"
        if self.state is ProcessState.RUNNING and self.pid is not None:
            parts.append(f"pid {self.pid}")
        if self.reason:
            parts.append(self.reason if self.state is ProcessState.ENDED else f"before: {self.reason}")
        if self.restarts:
            parts.append(f"restarts: {self.restarts}")
        return f"{self.label}: {', '.join(parts)}"


@dataclass(frozen=True, slots=True)
class OutputLine:
    """A line of output, without its line end.

    Attributes:
        process: The label of the process.
        text: The line. Bytes that are not UTF-8 are replaced.
        number: Its number among all lines of the launch, from 1.
    """

    process: str
    text: str
    number: int

    def __str__(self) -> str:
        return f"[{self.process}] {self.text}"


class Search:
    """Finds the first line that matches.

    Args:
        text: A part of the line, or a pattern that is searched in it.
        process: Name of the process that writes it; None: any.

    Attributes:
        found: The line; None until there is one.
    """

    def __init__(self, text: str | re.Pattern[str], process: str | None) -> None:
        self.found: OutputLine | None = None
        self._pattern = re.compile(re.escape(text)) if isinstance(text, str) else text
        self._process = process

    def check(self, line: OutputLine, writer: ProcessStatus) -> None:
        """Check a line."""
        if (
            self.found is None
            and (self._process is None or writer.is_called(self._process))
            and self._pattern.search(line.text)
        ):
            self.found = line


class Transcript:
    """The output and the processes of a launch so far. `on_event` is its listener.

    Args:
        max_lines: Most lines to keep.
        max_bytes: Most bytes of lines to keep.

    Attributes:
        dropped_lines: Lines dropped so far.
    """

    def __init__(self, *, max_lines: int = MAX_LINES, max_bytes: int = MAX_BYTES) -> None:
        self.dropped_lines = 0
        self._max_lines = max_lines
        self._max_bytes = max_bytes
        self._lines: deque[tuple[OutputLine, ProcessStatus, int]] = deque()
        """Each with its process and its size in bytes."""
        self._bytes = 0
        self._number = 0
        self._searches: dict[Search, None] = {}
        self._launch = ProcessStatus(label=LAUNCH, name=LAUNCH, state=ProcessState.RUNNING)
        self._processes: dict[str, ProcessStatus] = {}
        self._restarting: set[str] = set()
        """Labels of processes that are stopped in order to be started again."""

    @property
    def processes(self) -> tuple[ProcessStatus, ...]:
        """All processes, in the order in which they appeared."""
        return tuple(self._processes.values())

    def called(self, name: str) -> list[ProcessStatus]:
        """Return the processes that a name identifies."""
        return [each for each in self._processes.values() if each.is_called(name)]

    def lines(self, process: str | None = None) -> Iterator[OutputLine]:
        """Yield the kept lines: all, or those of one process; "launch" is the launch itself."""
        for line, writer, _ in self._lines:
            if process is None or writer.is_called(process):
                yield line

    def begin(self, search: Search, *, after: OutputLine | None = None) -> None:
        """Check the kept lines after `after`, and then each new one until `end`."""
        for line, writer, _ in self._lines:
            if after is None or line.number > after.number:
                search.check(line, writer)
        self._searches[search] = None

    def end(self, search: Search) -> None:
        """Stop checking."""
        self._searches.pop(search, None)

    def on_event(self, event: events.Event) -> None:
        """Record an event."""
        match event:
            case events.ProcessIO():
                writer = self._enter(event.process)
                for each in event.lines:
                    self._write(writer, each.decode(errors="replace"), len(each))
            case events.Message():
                about = "" if event.about == LAUNCH else f"{event.about}: "
                self._write(self._launch, f"{about}{event.text}", len(event.text))
            case events.ProcessStarted():
                self._change(event.process, state=ProcessState.RUNNING, pid=event.pid)
            case events.ProcessWaits():
                self._change(event.process, state=ProcessState.WAITING, missing=event.missing)
            case events.ProcessRestarts():
                self._on_restart(event.process)
            case events.ProcessExited():
                self._on_exit(event.process, event.outcome)
            case events.ShuttingDown():
                self._on_shutdown()
            case _:
                pass

    def _enter(self, spec: ProcessSpec) -> ProcessStatus:
        """Return the status of a process, a new one for a new process."""
        known = self._processes.get(spec.label)
        if known is None:
            if len(self._processes) >= MAX_PROCESSES:
                self._forget()
            known = ProcessStatus(
                label=spec.label, name=spec.name, node=spec.node, state=ProcessState.RUNNING
            )
            self._processes[spec.label] = known
        return known

    def _forget(self) -> None:
        """Forget the oldest ended process; `MAX_PROCESSES` is high enough that there is one."""
        for label, each in self._processes.items():
            if each.state is ProcessState.ENDED:
                del self._processes[label]
                return

    def _change(self, spec: ProcessSpec, **changes: Any) -> None:
        self._processes[spec.label] = replace(self._enter(spec), **changes)

    def _on_restart(self, spec: ProcessSpec) -> None:
        known = self._enter(spec)
        if known.state is ProcessState.RUNNING:
            self._restarting.add(spec.label)
        else:
            self._change(spec, state=ProcessState.RESTARTING, restarts=known.restarts + 1)

    def _on_exit(self, spec: ProcessSpec, outcome: Outcome) -> None:
        code = outcome.returncode
        if code is None:
            code = 0 if outcome.normal else 1
        self._change(spec, state=ProcessState.ENDED, exit_code=code, reason=outcome.reason)
        if spec.label in self._restarting:
            self._restarting.discard(spec.label)
            self._on_restart(spec)

    def _on_shutdown(self) -> None:
        """Mark processes that do not run as ended."""
        self._restarting.clear()
        for label, each in self._processes.items():
            if each.state is not ProcessState.RUNNING:
                self._processes[label] = replace(each, state=ProcessState.ENDED)

    def _write(self, writer: ProcessStatus, text: str, size: int) -> None:
        self._number += 1
        line = OutputLine(writer.label, text, self._number)
        for search in self._searches:
            search.check(line, writer)
        self._lines.append((line, writer, size))
        self._bytes += size
        while len(self._lines) > self._max_lines or self._bytes > self._max_bytes:
            _, _, gone = self._lines.popleft()
            self._bytes -= gone
            self.dropped_lines += 1
