"""The processes of a launch, and their states."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from actors.launch.planning.process_spec import MAX_PROCESSES
from actors.processes.backoff import Backoff

if TYPE_CHECKING:
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.launch.planning.steps import AddHandler


class ProcessState(Enum):
    """The state of a process."""

    WAITING = "waiting"
    """Waits for its dependencies."""
    UP = "up"
    """Running, or being started or stopped."""
    RESTARTING = "restarting"
    """Has ended and will be started again."""
    DEAD = "dead"
    """Has ended; only `restart` starts it again, such as after a change of its sources."""


class ProcessEntry:
    """A process.

    Attributes:
        spec: What to run.
        on_exit: What to do whenever it ends.
        state: Its state.
        since: When it entered that state, in seconds of the runner's clock.
        generation: Number of its changes of state. Timers compare it, to notice that they are outdated.
        pid: Its process id; None if it does not run, or runs in this process.
        split: Whether its stdout and stderr are separate streams.
        restart_pending: Whether to start it again when it has ended.
    """

    def __init__(self, spec: ProcessSpec, on_exit: AddHandler | None = None) -> None:
        self.spec = spec
        self.on_exit = on_exit
        self.state = ProcessState.DEAD
        self.since = 0.0
        self.generation = 0
        self.pid: int | None = None
        self.split = False
        self.restart_pending = False
        self._respawns = 0
        self._backoff = Backoff(spec.respawn_delay_sec, spec.respawn_max_delay_sec, spec.respawn_backoff)

    def missing(self, there: frozenset[Presence]) -> tuple[Presence, ...]:
        """Return the dependencies that are not there."""
        return tuple(each for each in self.spec.depends_on if each not in there)

    def respawn_delay(self, lived_sec: float) -> float | None:
        """Count a respawn, and return the seconds before it; None if the process is not started again."""
        spec = self.spec
        if not spec.respawn or self._respawns == spec.respawn_max_retries:
            return None
        self._respawns += 1
        return self._backoff.next(lived_sec)

    def reset_respawns(self) -> None:
        """Start counting respawns, and their delays, from the beginning."""
        self._respawns = 0
        self._backoff.reset()


class ProcessTable:
    """Processes by label: those that are not dead, and dead ones that may be started again.

    Attributes:
        living: Number of processes that are not dead.
    """

    def __init__(self) -> None:
        self.living = 0
        self._processes: dict[str, ProcessEntry] = {}

    def __getitem__(self, label: str) -> ProcessEntry:
        return self._processes[label]

    def get(self, label: str) -> ProcessEntry | None:
        """Return the process with a label; None if there is none, or it has been dropped."""
        return self._processes.get(label)

    def add(self, spec: ProcessSpec, on_exit: AddHandler | None = None) -> ProcessEntry | None:
        """Add a process in state DEAD, in place of a dead one with its label.

        Returns:
            The entry; None if `MAX_PROCESSES` others are not dead. Otherwise the oldest dead one is dropped.
        """
        # Dead ones are kept for `restart` only; a launch that goes on making processes must not grow.
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
        # Counted here, because the machine asks after each event whether anything is left.
        self.living += (state is not dead) - (process.state is not dead)
        process.state, process.since = state, now
        process.generation += 1
