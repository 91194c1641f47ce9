"""The transcript of a launch: what its processes have written, and what has become of them.

It is bounded: what is over a limit goes, the oldest first, and lines that have gone are counted. A line that
somebody waits for is looked for as it comes, so that it is found however much comes with it.
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
    from actors.launch.planning.steps import ProcessSpec
    from actors.processes.outcome import Outcome

MAX_LINES: Final = 10_000
MAX_BYTES: Final = 4 * 1024 * 1024
"""What the lines that are kept were long, all together."""
MAX_PROCESSES: Final = 2000
"""Twice what a launch may run at a time. Beyond it those that have ended are forgotten."""
LAUNCH: Final = "launch"
"""The label of what the launch itself says."""


class ProcessState(Enum):
    """Where a process of a launch is in its life."""

    WAITING = "waiting"
    """For what it depends on."""
    RUNNING = "running"
    RESTARTING = "restarting"
    """It has ended, and will be started again."""
    ENDED = "ended"


@dataclass(frozen=True, kw_only=True, slots=True)
class ProcessStatus:
    """A process of a launch at one moment.

    Attributes:
        label: What it is called in the launch: "talker-1".
        name: The label without its number.
        node: The full name of its node, where the description says it.
        state: Where it is in its life.
        pid: Its number, the last one it had; None if it has none.
        restarts: How often it has been started again.
        exit_code: What it has ended with, the last time that it did; negative for a signal. What has none,
            because it is a node in this process or could not be run, has 0 if it ended well and otherwise 1.
        reason: The same in words: "exit code 1", "killed by SIGKILL".
        missing: What it waits for.
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
        """Tell whether a name means this one: its label, the label without the number, or its node's."""
        return name in {self.label, self.name, self.node}

    def __str__(self) -> str:
        """Say it in one line."""
        said = [self.state.value]
        if self.state is ProcessState.WAITING and self.missing:
            said[0] += f" for {' and '.join(map(str, self.missing))}"
        if self.state is ProcessState.RUNNING and self.pid is not None:
            said.append(f"pid {self.pid}")
        if self.reason:
            said.append(self.reason if self.state is ProcessState.ENDED else f"before: {self.reason}")
        if self.restarts:
            said.append(f"restarts: {self.restarts}")
        return f"{self.label}: {', '.join(said)}"


@dataclass(frozen=True, slots=True)
class OutputLine:
    """A line that a process has written, without its end.

    Attributes:
        process: Its label.
        text: The line. Bytes that are no UTF-8 are replaced.
        number: Which it is of all lines of the launch, from 1.
    """

    process: str
    text: str
    number: int

    def __str__(self) -> str:
        return f"[{self.process}] {self.text}"


class Search:
    """Looks for a line as the lines come.

    Args:
        what: A text that is in the line, or a pattern that is.
        process: Whose; None: anybody's.

    Attributes:
        found: The first one.
    """

    def __init__(self, what: str | re.Pattern[str], process: str | None) -> None:
        self.found: OutputLine | None = None
        self._pattern = re.compile(re.escape(what)) if isinstance(what, str) else what
        self._process = process

    def look(self, line: OutputLine, writer: ProcessStatus) -> None:
        """Look at a line."""
        if (
            self.found is None
            and (self._process is None or writer.is_called(self._process))
            and self._pattern.search(line.text)
        ):
            self.found = line


class Transcript:
    """What has happened in a launch so far. `hear` is its listener.

    Args:
        max_lines: How many lines are kept.
        max_bytes: What these were long.

    Attributes:
        dropped_lines: Lines that are not kept any more.
    """

    def __init__(self, *, max_lines: int = MAX_LINES, max_bytes: int = MAX_BYTES) -> None:
        self.dropped_lines = 0
        self._max_lines = max_lines
        self._max_bytes = max_bytes
        self._lines: deque[tuple[OutputLine, ProcessStatus, int]] = deque()
        """Each with who has written it, and its bytes."""
        self._bytes = 0
        self._number = 0
        self._searches: dict[Search, None] = {}
        self._launch = ProcessStatus(label=LAUNCH, name=LAUNCH, state=ProcessState.RUNNING)
        self._processes: dict[str, ProcessStatus] = {}
        self._again: set[str] = set()
        """Those that are being stopped in order to be started again."""

    # What is to be known

    @property
    def processes(self) -> tuple[ProcessStatus, ...]:
        """All processes, in the order in which they came."""
        return tuple(self._processes.values())

    def called(self, name: str) -> list[ProcessStatus]:
        """Return the processes that a name means."""
        return [each for each in self._processes.values() if each.is_called(name)]

    def lines(self, process: str | None = None) -> Iterator[OutputLine]:
        """Yield the lines that are kept; those of a process alone; with "launch", of the launch itself."""
        for line, writer, _ in self._lines:
            if process is None or writer.is_called(process):
                yield line

    def begin(self, search: Search, *, after: OutputLine | None = None) -> None:
        """Look at the lines that are kept, behind `after`, and then at those that come, until `end`."""
        for line, writer, _ in self._lines:
            if after is None or line.number > after.number:
                search.look(line, writer)
        self._searches[search] = None

    def end(self, search: Search) -> None:
        """Look no further."""
        self._searches.pop(search, None)

    # What happens

    def hear(self, event: events.Event) -> None:
        """Listener: take an event in."""
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
                self._restarts(event.process)
            case events.ProcessExited():
                self._exited(event.process, event.outcome)
            case events.ShuttingDown():
                self._stops()
            case _:
                pass

    def _enter(self, spec: ProcessSpec) -> ProcessStatus:
        """Return what is known of a process."""
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
        """Forget the oldest one that has ended. A launch does not run so many that there is none."""
        for label, each in self._processes.items():
            if each.state is ProcessState.ENDED:
                del self._processes[label]
                return

    def _change(self, spec: ProcessSpec, **changes: Any) -> None:
        self._processes[spec.label] = replace(self._enter(spec), **changes)

    def _restarts(self, spec: ProcessSpec) -> None:
        known = self._enter(spec)
        if known.state is ProcessState.RUNNING:
            self._again.add(spec.label)
        else:
            self._change(spec, state=ProcessState.RESTARTING, restarts=known.restarts + 1)

    def _exited(self, spec: ProcessSpec, outcome: Outcome) -> None:
        code = outcome.returncode
        if code is None:
            code = 0 if outcome.normal else 1
        self._change(spec, state=ProcessState.ENDED, exit_code=code, reason=outcome.reason)
        if spec.label in self._again:
            self._again.discard(spec.label)
            self._restarts(spec)

    def _stops(self) -> None:
        """What does not run will not run any more."""
        self._again.clear()
        for label, each in self._processes.items():
            if each.state is not ProcessState.RUNNING:
                self._processes[label] = replace(each, state=ProcessState.ENDED)

    def _write(self, writer: ProcessStatus, text: str, size: int) -> None:
        self._number += 1
        line = OutputLine(writer.label, text, self._number)
        for search in self._searches:
            search.look(line, writer)
        self._lines.append((line, writer, size))
        self._bytes += size
        while len(self._lines) > self._max_lines or self._bytes > self._max_bytes:
            _, _, gone = self._lines.popleft()
            self._bytes -= gone
            self.dropped_lines += 1
