"""The process table: the processes of a launch, and where each is in its life."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from actors.launch.planning.process_spec import MAX_PROCESSES
from actors.processes.backoff import Backoff

if TYPE_CHECKING:
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.launch.planning.steps import React


class ProcessState(Enum):
    """Where a process is in its life."""

    WAITING = "waiting"
    """For what it depends on."""
    UP = "up"
    """Running, or being started or stopped."""
    RESTARTING = "restarting"
    """It has ended and will be started again."""
    DEAD = "dead"
    """It has ended for good; but a change of its source starts it again."""


class ProcessEntry:
    """A process.

    Attributes:
        spec: What to run.
        on_exit: What to do whenever it ends.
        state: Where it is in its life.
        since: Since when.
        generation: Grows with each change of the state, so that timers for an earlier one are recognised.
        pid: Its number while it runs; None if it has none.
        split: Whether its stdout and stderr are told apart while it runs.
        again: Whether it is to be started again when it has ended.
    """

    def __init__(self, spec: ProcessSpec, on_exit: React | None = None) -> None:
        self.spec = spec
        self.on_exit = on_exit
        self.state = ProcessState.DEAD
        self.since = 0.0
        self.generation = 0
        self.pid: int | None = None
        self.split = False
        self.again = False
        self._respawns = 0
        self._backoff = Backoff(spec.respawn_delay_sec, spec.respawn_max_delay_sec, spec.respawn_backoff)

    def missing(self, there: frozenset[Presence]) -> tuple[Presence, ...]:
        """Return what it depends on and is not there."""
        return tuple(each for each in self.spec.depends_on if each not in there)

    def respawn_delay(self, lived_sec: float) -> float | None:
        """Count a respawn, and return in how many seconds it is due; None: it does not come again."""
        spec = self.spec
        if not spec.respawn or self._respawns == spec.respawn_max_retries:
            return None
        self._respawns += 1
        return self._backoff.next(lived_sec)

    def forgive(self) -> None:
        """Forget how often it has died."""
        self._respawns = 0
        self._backoff.reset()


class ProcessTable:
    """Processes by their labels: those that live, and dead ones that may be started again.

    Attributes:
        living: How many are not dead.
    """

    def __init__(self) -> None:
        self.living = 0
        self._processes: dict[str, ProcessEntry] = {}

    def __getitem__(self, label: str) -> ProcessEntry:
        return self._processes[label]

    def get(self, label: str) -> ProcessEntry | None:
        """Return a process; None if there is none of this label (any more)."""
        return self._processes.get(label)

    def add(self, spec: ProcessSpec, on_exit: React | None = None) -> ProcessEntry | None:
        """Return a new process, dead as yet, in place of a dead one of its label.

        Returns:
            None if there are too many; the one that has been dead for longest is replaced.
        """
        if len(self._processes) >= MAX_PROCESSES:
            dead = self.in_state(ProcessState.DEAD)
            if not dead:
                return None
            self.drop(dead[0])
        process = self._processes[spec.label] = ProcessEntry(spec, on_exit)
        return process

    def drop(self, process: ProcessEntry) -> None:
        """Forget a dead process."""
        del self._processes[process.spec.label]

    def alive(self) -> list[ProcessEntry]:
        """Return all processes that are not dead."""
        return [each for each in self._processes.values() if each.state is not ProcessState.DEAD]

    def in_state(self, state: ProcessState) -> list[ProcessEntry]:
        """Return all processes in a state."""
        return [each for each in self._processes.values() if each.state is state]

    def move(self, process: ProcessEntry, state: ProcessState, now: float) -> None:
        """Move a process to another state."""
        dead = ProcessState.DEAD
        self.living += (state is not dead) - (process.state is not dead)
        process.state, process.since = state, now
        process.generation += 1
