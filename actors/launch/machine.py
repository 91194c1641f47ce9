"""The machine: what a launch does next, going by what has happened. No I/O and no clock.

It is told what happens and when (`started`, `ended`, `graph`, `tick`, `stop`, …); each call returns effects,
which the runner carries out in order. It wants to be ticked at `wake_at`. It is `over` when nothing runs and
nothing is to come.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

from actors.launch.agenda import Agenda
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
from actors.launch.handlers import MAX_HANDLERS, Handlers, ask
from actors.launch.roster import ProcessState, Roster
from actors.launch.steps import MAX_PROCESSES, Call, End, ProcessSpec, React, Say, Start, all_steps
from actors.supervision.outcome import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from actors.launch.events import Stream
    from actors.launch.handlers import Answer
    from actors.launch.presence import Presence
    from actors.launch.roster import Process
    from actors.launch.steps import Step

REMINDER_SEC: Final = 10.0
"""When it is said that a process still waits; then after twice, four times … as long."""
HURRY_AFTER_SEC: Final = 0.2
"""Two wishes to stop that are closer together are one: `timeout` and terminals may signal twice."""
UNSPLIT: Final = "its stdout and stderr are read as one, so that handlers for one of them hear nothing"


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
        self._split = _splits(steps)
        self._roster = Roster()
        self._handlers = Handlers()
        self._agenda = Agenda()
        self._failed_runs: set[str] = set()
        self._stopped_at = 0.0
        self._effects: list[Effect] = []

    # What is to be known

    @property
    def succeeded(self) -> bool:
        """Whether the launch has not failed, nor the last run of any process."""
        return not self.failed and not self._failed_runs

    @property
    def over(self) -> bool:
        """Whether the launch has ended: nothing runs, and nothing will."""
        return self.stopping and not self._roster.living

    @property
    def wake_at(self) -> float | None:
        """When it wants to be ticked; None: not before something happens."""
        return self._agenda.next_at

    def state(self, label: str) -> ProcessState:
        """Return where a process is in its life; one that nobody knows any more is dead."""
        process = self._roster.get(label)
        return ProcessState.DEAD if process is None else process.state

    # What happens

    def begin(self, now: float) -> list[Effect]:
        """Begin."""
        self._take(self._steps, now)
        return self._done(now)

    def started(self, label: str, pid: int | None, now: float) -> list[Effect]:
        """A process runs."""
        process = self._roster[label]
        process.pid = pid
        self._happen(ProcessStarted(process.spec, pid), now)
        return self._done(now)

    def wrote(self, label: str, stream: Stream, lines: Sequence[bytes], now: float) -> list[Effect]:
        """A process has written lines."""
        process = self._roster[label]
        self._happen(ProcessIO(process.spec, process.pid, stream, tuple(lines)), now)
        return self._done(now)

    def ended(self, label: str, outcome: Outcome, now: float) -> list[Effect]:
        """A process has ended, or could not be started."""
        self._end(self._roster[label], outcome, now)
        return self._done(now)

    def graph(self, presences: frozenset[Presence], now: float) -> list[Effect]:
        """The graph is known, or has changed: this is there now."""
        new = presences - self.presences
        self.presences = presences
        for each in sorted(new, key=str):
            self._happen(Appeared(each), now)
        for process in self._roster.in_state(ProcessState.WAITING):
            if not process.missing(presences):
                self._enter(process, now)
        return self._done(now)

    def restart(self, label: str, reason: str, now: float) -> list[Effect]:
        """Start a process again, whatever it does now; one that waits goes on doing so."""
        process = self._roster.get(label)
        waits = process is not None and (process.state is ProcessState.WAITING or process.again)
        if process is not None and not waits and not self.stopping:
            self._tell(ProcessRestarts(process.spec, process.pid, 0.0, reason))
            process.forgive()
            if process.state is ProcessState.UP:
                process.again = True
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
        for act in self._agenda.due(now):
            act(now)
        return self._done(now)

    # What is done

    def _done(self, now: float) -> list[Effect]:
        """Return what is to be done; a launch that has nothing left to do ends."""
        if not (self.stopping or self._roster.living or self._agenda.holding or self._keep):
            self._stop("nothing is left to run", now)
        effects, self._effects = self._effects, []
        return effects

    def _tell(self, event: Event) -> None:
        self._effects.append(Tell(event))

    def _happen(self, event: Event, now: float) -> None:
        """Tell of an event, and react to it."""
        self._tell(event)
        for answer in self._handlers.answers(event):
            self._heed(answer, now)

    def _heed(self, answer: Answer, now: float) -> None:
        """Do what a function of the description has said; if that was a mistake, end."""
        if answer.mistake:
            self._fail(answer.mistake, now)
        self._take(answer.steps, now)

    def _fail(self, mistake: str, now: float) -> None:
        self.mistake = self.mistake or mistake
        self.failed = True
        self._tell(Message(Level.ERROR, mistake))
        self._stop("the description has a mistake", now)

    def _take(self, steps: Sequence[Step], now: float) -> None:
        """Take steps: each when it is due. Handlers come first, so that they miss nothing."""
        for step in sorted(steps, key=lambda step: not isinstance(step, React)):
            if step.after_sec <= 0:
                self._step(step, now)
            elif not self.stopping:
                self._agenda.add(now + step.after_sec, partial(self._step, step), holds=True)

    def _step(self, step: Step, now: float) -> None:
        match step:
            case Start():
                self._start(step.process, now)
            case Say():
                self._tell(Message(Level.WARN if step.warning else Level.INFO, step.text))
            case End():
                self._stop(step.reason, now)
            case Call():
                self._heed(ask(step.steps), now)
            case React():
                self._register(step, now)

    def _register(self, handler: React, now: float) -> None:
        if self._handlers.full:
            self._fail(f"There are more than {MAX_HANDLERS} event handlers", now)
            return
        self._handlers.add(handler)
        if handler.split and not self._split:
            self._split = True
            for process in self._roster.in_state(ProcessState.UP):
                if not process.split:
                    self._tell(Message(Level.WARN, UNSPLIT, process.spec.label))
        if handler.presence in self.presences:
            self._heed(self._handlers.answer(handler, Appeared(handler.presence)), now)

    # The life of a process

    def _start(self, spec: ProcessSpec, now: float) -> None:
        if self.stopping:
            return
        if self.state(spec.label) is not ProcessState.DEAD:
            self._tell(Message(Level.WARN, "runs already; it is not started a second time", spec.label))
            return
        process = self._roster.add(spec)
        if process is None:
            self._fail(f"More than {MAX_PROCESSES} processes would run", now)
            return
        self._enter(process, now)

    def _enter(self, process: Process, now: float) -> None:
        """Start a process, when what it depends on is there."""
        if process.missing(self.presences):
            self._wait(process, now)
            return
        self._roster.move(process, ProcessState.UP, now)
        process.split = self._split or process.spec.output.splits
        self._effects.append(Run(process.spec, process.split))

    def _wait(self, process: Process, now: float) -> None:
        self._roster.move(process, ProcessState.WAITING, now)
        self._remind(process, process.turn, now)
        deadline = now + process.spec.depends_timeout_sec
        if deadline < math.inf:
            self._agenda.add(deadline, partial(self._waited_enough, process, process.turn))

    def _remind(self, process: Process, turn: int, now: float) -> None:
        if process.turn == turn:
            so_far_sec = now - process.since
            self._tell(ProcessWaits(process.spec, None, process.missing(self.presences), so_far_sec))
            later = now + max(so_far_sec, REMINDER_SEC)
            self._agenda.add(later, partial(self._remind, process, turn))

    def _waited_enough(self, process: Process, turn: int, now: float) -> None:
        if process.turn == turn:
            missing = " and ".join(map(str, process.missing(self.presences)))
            reason = f"{missing} was not there within {process.spec.depends_timeout_sec:g} s"
            self._end(process, Outcome(normal=False, reason=reason), now)

    def _end(self, process: Process, outcome: Outcome, now: float) -> None:
        """A process has ended: tell, react, and see what that means."""
        spec = process.spec
        lived_sec = now - process.since
        self._note_run(process, outcome)
        self._roster.move(process, ProcessState.DEAD, now)
        pid, process.pid = process.pid, None
        event = ProcessExited(spec, pid, outcome)
        self._happen(event, now)
        if spec.on_exit is not None:
            self._heed(ask(partial(spec.on_exit.steps, event)), now)
        if self._roster.get(spec.label) is not process:
            return  # that has started it anew
        if not self.stopping:
            self._go_on(process, outcome, lived_sec, now)
        if process.state is ProcessState.DEAD and (spec.made_later or not self._keep):
            self._roster.drop(process)

    def _note_run(self, process: Process, outcome: Outcome) -> None:
        """Remember whether the last run of a process failed. A signal from this launch is no failure."""
        label = process.spec.label
        # A process that stops at SIGINT or SIGTERM from the launch has a normal outcome already.
        killed_here = outcome.signal_name == "SIGKILL" and (self.stopping or process.again)
        if outcome.normal or killed_here:
            self._failed_runs.discard(label)
        elif len(self._failed_runs) < MAX_PROCESSES:
            self._failed_runs.add(label)

    def _go_on(self, process: Process, outcome: Outcome, lived_sec: float, now: float) -> None:
        """See what comes after the end of a process."""
        spec = process.spec
        if process.again:
            process.again = False
            self._enter(process, now)
        elif (delay := process.respawn_delay(lived_sec)) is not None:
            self._roster.move(process, ProcessState.RESTARTING, now)
            self._tell(ProcessRestarts(spec, None, delay, "respawn"))
            self._agenda.add(now + delay, partial(self._respawn, process, process.turn))
        elif spec.required and (outcome.normal or not self._keep):
            self.failed = self.failed or not outcome.normal
            reason = spec.end_reason and f"{spec.label} has ended: {spec.end_reason}"
            self._stop(reason or f"{spec.label} is required and has ended", now)

    def _respawn(self, process: Process, turn: int, now: float) -> None:
        if process.turn == turn:
            self._enter(process, now)

    def _stop(self, reason: str, now: float) -> None:
        if self.stopping:
            return
        self.stopping = True
        self._stopped_at = now
        self._agenda.clear()
        self._happen(ShuttingDown(reason), now)
        for state in (ProcessState.WAITING, ProcessState.RESTARTING):
            for process in self._roster.in_state(state):
                self._roster.move(process, ProcessState.DEAD, now)
        self._effects.append(StopAll())


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
