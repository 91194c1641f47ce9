"""The machine: what a launch does next, going by what has happened. No I/O and no clock.

It is told what happens and when (`started`, `ended`, `graph`, `tick`, `stop`, …); each call returns effects,
which the runner carries out in order. It wants to be ticked at `wake_at`. It is `over` when nothing runs and
nothing is to come.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

from actors.launch.events import (
    Appeared,
    Event,
    Level,
    Message,
    ProcessExited,
    ProcessIO,
    ProcessRestarts,
    ProcessStarted,
    ProcessWaits,
    ShuttingDown,
)
from actors.launch.steps import MAX_PROCESSES, Call, End, ProcessSpec, React, Say, Start, all_steps
from actors.supervision.outcome import Outcome
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.launch.events import Stream
    from actors.launch.presence import Presence
    from actors.launch.steps import Step

REMINDER_SEC: Final = 10.0
"""When it is said that a process still waits; then after twice, four times … as long."""
HURRY_AFTER_SEC: Final = 0.2
"""Two wishes to stop that are closer together are one: `timeout` and terminals may signal twice."""
MAX_HANDLERS: Final = 10_000
"""Event handlers; only a launch that makes them as it runs has so many."""


@dataclass(frozen=True)
class Run:
    """Start a process.

    Attributes:
        process: Which one.
        split: Whether stdout and stderr must be told apart.
    """

    process: ProcessSpec
    split: bool


@dataclass(frozen=True)
class Stop:
    """Stop a process.

    Attributes:
        label: Which one.
    """

    label: str


@dataclass(frozen=True)
class StopAll:
    """Stop all processes, at the same time."""


@dataclass(frozen=True)
class HurryAll:
    """Kill all processes."""


@dataclass(frozen=True)
class Tell:
    """Tell the listeners what has happened."""

    event: Event


Effect: TypeAlias = Run | Stop | StopAll | HurryAll | Tell


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


class _Process:
    """What the machine keeps of a process."""

    def __init__(self, spec: ProcessSpec) -> None:
        self.spec = spec
        self.state = ProcessState.DEAD
        self.since = 0.0
        self.pid: int | None = None
        self.restarts = 0
        self.delay_sec = spec.respawn_delay_sec
        self.again = ""
        self.turn = 0
        """Grows with each state, so that timers of an earlier one are known."""
        self.split = False


class Machine:
    """The state of a launch.

    Args:
        steps: What to do.
        keep: Whether it goes on when nothing is left to run, or a required process has died: processes can be
            started again by `restart`.

    Attributes:
        presences: What the graph has, as far as it is known.
        stopping: Whether the launch is being ended.
        failed: Whether a required process has died, or the description turned out to be wrong.
        mistake: What is wrong with the description, if that has turned out; the first thing.
    """

    def __init__(self, steps: Sequence[Step], *, keep: bool = False) -> None:
        self.presences: frozenset[Presence] = frozenset()
        self.stopping = False
        self.failed = False
        self.mistake = ""
        self._steps = steps
        self._keep = keep
        self._processes: dict[str, _Process] = {}
        self._living = 0
        self._split = _splits(steps)
        self._handlers: list[React] = []
        self._timers: list[tuple[float, int, Callable[[float], None]]] = []
        self._timed = 0
        self._due_steps = 0
        self._stopped_at = 0.0
        self._effects: list[Effect] = []

    # What is to be known

    @property
    def over(self) -> bool:
        """Whether the launch has ended: nothing runs, and nothing will."""
        return self.stopping and not self._living

    @property
    def wake_at(self) -> float | None:
        """When it wants to be ticked; None: not before something happens."""
        return self._timers[0][0] if self._timers else None

    def state(self, label: str) -> ProcessState:
        """Return where a process is in its life; one that nobody knows any more is dead."""
        process = self._processes.get(label)
        return ProcessState.DEAD if process is None else process.state

    # What happens

    def begin(self, now: float) -> list[Effect]:
        """Begin."""
        self._take(self._steps, now)
        return self._done(now)

    def started(self, label: str, pid: int | None, now: float) -> list[Effect]:
        """A process runs."""
        process = self._processes[label]
        process.pid = pid
        self._happen(ProcessStarted(process.spec, pid), now)
        return self._done(now)

    def wrote(self, label: str, stream: Stream, lines: Sequence[bytes], now: float) -> list[Effect]:
        """A process has written lines."""
        process = self._processes[label]
        self._happen(ProcessIO(process.spec, process.pid, stream, tuple(lines)), now)
        return self._done(now)

    def ended(self, label: str, outcome: Outcome, now: float) -> list[Effect]:
        """A process has ended, or could not be started."""
        self._end(self._processes[label], outcome, now)
        return self._done(now)

    def graph(self, presences: frozenset[Presence], now: float) -> list[Effect]:
        """The graph is known, or has changed: this is there now."""
        new = presences - self.presences
        self.presences = presences
        for each in sorted(new, key=str):
            self._happen(Appeared(each), now)
        for process in tuple(self._processes.values()):
            if process.state is ProcessState.WAITING and not self._missing(process.spec):
                self._run(process, now)
        return self._done(now)

    def restart(self, label: str, reason: str, now: float) -> list[Effect]:
        """Start a process again, whatever it does now; one that waits goes on doing so."""
        process = self._processes.get(label)
        if process is None or self.stopping or process.state is ProcessState.WAITING or process.again:
            return self._done(now)
        self._tell(ProcessRestarts(process.spec, process.pid, 0.0, reason))
        process.restarts, process.delay_sec = 0, process.spec.respawn_delay_sec
        if process.state is ProcessState.UP:
            process.again = reason
            self._effects.append(Stop(label))
        else:
            self._enter(process, now)
        return self._done(now)

    def stop(self, reason: str, now: float, *, insist: bool = True) -> list[Effect]:
        """End the launch; a second time, a moment later, kill what is left, if that is insisted on."""
        if not self.stopping:
            self._stop(reason, now)
        elif insist and now - self._stopped_at >= HURRY_AFTER_SEC:
            self._effects.append(HurryAll())
        return self._done(now)

    def tick(self, now: float) -> list[Effect]:
        """Time has passed."""
        while self._timers and self._timers[0][0] <= now:
            heapq.heappop(self._timers)[2](now)
        return self._done(now)

    # What is done

    def _done(self, now: float) -> list[Effect]:
        """Return what is to be done; a launch that has nothing left to do ends."""
        if not (self.stopping or self._living or self._due_steps or self._keep):
            self._stop("nothing is left to run", now)
        effects, self._effects = self._effects, []
        return effects

    def _tell(self, event: Event) -> None:
        self._effects.append(Tell(event))

    def _happen(self, event: Event, now: float) -> None:
        """Tell of an event, and react to it."""
        self._tell(event)
        for handler in [each for each in self._handlers if each.matches(event)]:
            self._react(handler, event, now)

    def _react(self, handler: React, event: Event, now: float) -> None:
        good = self._take_from(partial(handler.steps, event), now)
        if (handler.once or not good) and handler in self._handlers:
            self._handlers.remove(handler)

    def _take_from(self, give: Callable[[], Sequence[Step]], now: float) -> bool:
        """Take steps that a function of the description gives; return whether it gave any."""
        try:
            steps = give()
        except CallboardError as error:
            self._mistake(str(error), now)
            return False
        self._take(steps, now)
        return True

    def _mistake(self, text: str, now: float) -> None:
        self.mistake = self.mistake or text
        self.failed = True
        self._tell(Message(Level.ERROR, text))
        self._stop("the description has a mistake", now)

    def _take(self, steps: Sequence[Step], now: float) -> None:
        """Take steps: each when it is due. Handlers come first, so that they miss nothing."""
        for step in sorted(steps, key=lambda step: not isinstance(step, React)):
            if step.after_sec <= 0:
                self._step(step, now)
            elif not self.stopping:
                self._due_steps += 1
                self._at(now + step.after_sec, partial(self._due, step))

    def _due(self, step: Step, now: float) -> None:
        if not self.stopping:
            self._due_steps -= 1
            self._step(step, now)

    def _step(self, step: Step, now: float) -> None:
        match step:
            case Start():
                self._start(step.process, now)
            case Say():
                self._tell(Message(Level.WARN if step.warning else Level.INFO, step.text))
            case End():
                self._stop(step.reason, now)
            case Call():
                self._take_from(step.steps, now)
            case React():
                self._register(step, now)

    def _register(self, step: React, now: float) -> None:
        if len(self._handlers) >= MAX_HANDLERS:
            self._mistake(f"There are more than {MAX_HANDLERS} event handlers", now)
            return
        self._handlers.append(step)
        if step.split and not self._split:
            self._split_from_now_on()
        if step.presence in self.presences:
            self._react(step, Appeared(step.presence), now)

    def _split_from_now_on(self) -> None:
        self._split = True
        for each in self._processes.values():
            if each.state is ProcessState.UP and not each.split:
                text = "its stdout and stderr are read as one, so that handlers for one of them hear nothing"
                self._tell(Message(Level.WARN, text, each.spec.label))

    def _start(self, spec: ProcessSpec, now: float) -> None:
        if self.stopping:
            return
        known = self._processes.get(spec.label)
        if known is not None and known.state is not ProcessState.DEAD:
            self._tell(Message(Level.WARN, "runs already; it is not started a second time", spec.label))
            return
        if len(self._processes) >= MAX_PROCESSES:
            dead = [label for label, each in self._processes.items() if each.state is ProcessState.DEAD]
            if not dead:
                self._mistake(f"More than {MAX_PROCESSES} processes would run", now)
                return
            del self._processes[dead[0]]
        process = self._processes[spec.label] = _Process(spec)
        self._enter(process, now)

    def _enter(self, process: _Process, now: float) -> None:
        """Start a process, when what it depends on is there."""
        if self._missing(process.spec):
            self._wait(process, now)
        else:
            self._run(process, now)

    def _run(self, process: _Process, now: float) -> None:
        self._move(process, ProcessState.UP, now)
        process.split = self._split or process.spec.output.splits
        self._effects.append(Run(process.spec, process.split))

    # Waiting

    def _missing(self, spec: ProcessSpec) -> tuple[Presence, ...]:
        return tuple(each for each in spec.depends_on if each not in self.presences)

    def _wait(self, process: _Process, now: float) -> None:
        self._move(process, ProcessState.WAITING, now)
        self._remind(process, process.turn, now)
        deadline = now + process.spec.depends_timeout_sec
        turn = process.turn
        if deadline < float("inf"):
            self._at(deadline, partial(self._waited_enough, process, turn))

    def _remind(self, process: _Process, turn: int, now: float) -> None:
        if process.turn == turn:
            missing = self._missing(process.spec)
            so_far_sec = now - process.since
            self._tell(ProcessWaits(process.spec, None, missing, so_far_sec))
            self._at(now + max(so_far_sec, REMINDER_SEC), partial(self._remind, process, turn))

    def _waited_enough(self, process: _Process, turn: int, now: float) -> None:
        if process.turn != turn:
            return
        missing = " and ".join(map(str, self._missing(process.spec)))
        reason = f"{missing} was not there within {process.spec.depends_timeout_sec:g} s"
        self._end(process, Outcome(normal=False, reason=reason), now)

    # Ends

    def _end(self, process: _Process, outcome: Outcome, now: float) -> None:
        """A process has ended: tell, react, and see what that means."""
        spec = process.spec
        lived_sec = now - process.since
        self._move(process, ProcessState.DEAD, now)
        pid, process.pid = process.pid, None
        event = ProcessExited(spec, pid, outcome)
        self._happen(event, now)
        if spec.on_exit is not None:
            self._take_from(partial(spec.on_exit.steps, event), now)
        if self._processes.get(spec.label) is not process:
            return  # that has started it anew
        if self.stopping:
            pass
        elif process.again:
            process.again = ""
            self._enter(process, now)
        elif spec.respawn and process.restarts != spec.respawn_max_retries:
            self._respawn(process, lived_sec, now)
        elif spec.required and (outcome.normal or not self._keep):
            self.failed = self.failed or not outcome.normal
            self._stop(f"{spec.label} is required and has ended", now)
        if process.state is ProcessState.DEAD and (spec.made_later or not self._keep):
            del self._processes[spec.label]

    def _respawn(self, process: _Process, lived_sec: float, now: float) -> None:
        spec = process.spec
        if lived_sec >= 2 * spec.respawn_max_delay_sec:
            process.delay_sec = spec.respawn_delay_sec
        delay = process.delay_sec
        process.delay_sec = min(delay * spec.respawn_backoff, spec.respawn_max_delay_sec)
        process.restarts += 1
        self._move(process, ProcessState.RESTARTING, now)
        turn = process.turn
        self._tell(ProcessRestarts(spec, None, delay, "respawn"))

        def due(then: float) -> None:
            if process.turn == turn:
                self._enter(process, then)

        self._at(now + delay, due)

    def _stop(self, reason: str, now: float) -> None:
        if self.stopping:
            return
        self.stopping = True
        self._stopped_at = now
        self._timers.clear()
        self._happen(ShuttingDown(reason), now)
        for process in self._processes.values():
            if process.state is not ProcessState.UP:
                self._move(process, ProcessState.DEAD, now)
        self._effects.append(StopAll())

    def _move(self, process: _Process, state: ProcessState, now: float) -> None:
        """Let a process be in another state."""
        dead = ProcessState.DEAD
        self._living += (state is not dead) - (process.state is not dead)
        process.state, process.since = state, now
        process.turn += 1

    def _at(self, due: float, act: Callable[[float], None]) -> None:
        self._timed += 1
        heapq.heappush(self._timers, (due, self._timed, act))


def awaits_graph(steps: Iterable[Step]) -> bool:
    """Tell whether something in these steps depends on the graph, or may."""
    return any(
        isinstance(step, Call)
        or (isinstance(step, Start) and bool(step.process.depends_on))
        or (isinstance(step, React) and (step.presence is not None or not step.preview))
        for step in all_steps(steps)
    )


def _splits(steps: Iterable[Step]) -> bool:
    """Tell whether something in these steps must know stdout from stderr."""
    return any(isinstance(step, React) and step.split for step in all_steps(steps))
