"""The state machine of a launch: decides what to do next. No I/O and no clock.

The runner calls a method for each event (`started`, `ended`, `graph`, `tick`, `stop`, …) with the time; it
returns effects, which the runner carries out in order. `tick` is due at `wake_at`. The launch is `finished`
when nothing runs and nothing will be started.

Functions of the description may block, so the runner calls them in a thread: `Ask`, then `answered`. What
happens meanwhile is reported at once, but reacted to afterwards: reactions are generators, which run one
after the other in the order of their events. So the result does not depend on how long a function takes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.launch.engine.effects import Ask, ForceStopAll, Notify, Run, Stop, StopAll
from actors.launch.engine.handlers import MAX_HANDLERS, Answer, Handlers, ReactionQueue
from actors.launch.engine.process_table import ProcessState, ProcessTable
from actors.launch.engine.schedule import Schedule
from actors.launch.engine.transition_queue import TransitionQueue
from actors.launch.planning.events import (
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
    StateTransition,
)
from actors.launch.planning.process_spec import MAX_PROCESSES, ProcessSpec
from actors.launch.planning.steps import Call, ChangeStates, End, LogText, React, Start, splits_streams
from actors.processes.outcome import Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.engine.effects import Effect, RequestTransition
    from actors.launch.engine.handlers import Reaction
    from actors.launch.engine.process_table import ProcessEntry
    from actors.launch.planning.events import Stream
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.steps import Step

REMINDER_SEC: Final = 10.0
"""When a process that still waits is reported; then after twice, four times … as long."""
FORCE_STOP_AFTER_SEC: Final = 0.2
"""Two wishes to stop that are closer together are one: `timeout` and terminals may signal twice."""
LAST_FUNCTION_SEC: Final = 5.0
"""How long functions may go on when the launch ends; what they give then is ignored."""
UNSPLIT: Final = "its stdout and stderr are read as one, so that handlers for one of them hear nothing"


class Machine:
    """The state of a launch.

    Args:
        keep: Whether it goes on when nothing is left to run, or a required process has died: processes can be
            started again by `restart`.

    Attributes:
        presences: What the graph has, as far as it is known.
        stopping: Whether the launch is being ended.
        failed: Whether a required process has died, or the description turned out to be wrong.
        mistake: What is wrong with the description, if that has turned out; the first thing.
    """

    def __init__(self, *, keep: bool = False) -> None:
        self.presences: frozenset[Presence] = frozenset()
        self.stopping = False
        self.failed = False
        self.mistake = ""
        self._keep = keep
        self._split = False
        self._table = ProcessTable()
        self._handlers = Handlers()
        self._schedule = Schedule()
        self._failed_runs: set[str] = set()
        self._now = 0.0
        self._stopped_at = 0.0
        self._effects: list[Effect] = []
        self._reactions = ReactionQueue(self._effects.append, self._notify)
        self._transitions = TransitionQueue(self._effects.append, self._notify)

    # What is to be known

    @property
    def succeeded(self) -> bool:
        """Whether neither the launch nor the last run of any process has failed."""
        return not self.failed and not self._failed_runs

    @property
    def finished(self) -> bool:
        """Whether the launch has ended: nothing runs, and nothing will."""
        return self.stopping and not self._table.living and not self._reactions.waiting

    @property
    def wake_at(self) -> float | None:
        """When it wants to be ticked; None: not before something happens."""
        if self.stopping and self._reactions.waiting:
            return self._stopped_at + LAST_FUNCTION_SEC
        return self._schedule.next_at

    def state(self, label: str) -> ProcessState:
        """Return where a process is in its life; one that nobody knows any more is dead."""
        process = self._table.get(label)
        return ProcessState.DEAD if process is None else process.state

    # What happens

    def begin(self, steps: Sequence[Step], now: float) -> list[Effect]:
        """Begin to take the steps of a plan."""
        self._now = now
        self._split = splits_streams(steps)
        self._reactions.add(self._take(steps))
        return self._done()

    def started(self, label: str, pid: int | None, now: float) -> list[Effect]:
        """A process runs."""
        self._now = now
        process = self._table[label]
        process.pid = pid
        self._happen(ProcessStarted(process.spec, pid))
        self._transitions.started(process.spec)
        return self._done()

    def wrote(self, label: str, stream: Stream, lines: Sequence[bytes], now: float) -> list[Effect]:
        """A process has written lines."""
        self._now = now
        process = self._table[label]
        self._happen(ProcessIO(process.spec, process.pid, stream, tuple(lines)))
        return self._done()

    def ended(self, label: str, outcome: Outcome, now: float) -> list[Effect]:
        """A process has ended, or could not be started."""
        self._now = now
        self._end(self._table[label], outcome)
        return self._done()

    def answered(self, ask: Ask, answer: Answer, now: float) -> list[Effect]:
        """A function of the description has returned."""
        self._now = now
        self._reactions.answered(ask, answer)
        return self._done()

    def state_changed(self, event: StateTransition, now: float) -> list[Effect]:
        """A lifecycle node has made a step of a transition."""
        self._now = now
        self._happen(event)
        return self._done()

    def transition_ended(self, request: RequestTransition, failure: str | None, now: float) -> list[Effect]:
        """A request of a transition has ended: None if it succeeded, otherwise why not."""
        self._now = now
        self._transitions.answered(request, failure)
        return self._done()

    def graph(self, presences: frozenset[Presence], now: float) -> list[Effect]:
        """The graph is known, or has changed: this is there now."""
        self._now = now
        new = presences - self.presences
        self.presences = presences
        for each in sorted(new, key=str):
            self._happen(Appeared(each))
        for process in self._table.in_state(ProcessState.WAITING):
            if not process.missing(presences):
                self._enter(process)
        return self._done()

    def restart(self, label: str, reason: str, now: float) -> list[Effect]:
        """Start a process again, whatever it does now; one that waits goes on doing so."""
        self._now = now
        process = self._table.get(label)
        waits = process is not None and (process.state is ProcessState.WAITING or process.again)
        if process is not None and not waits and not self.stopping:
            self._notify(ProcessRestarts(process.spec, process.pid, 0.0, reason))
            process.forgive()
            if process.state is ProcessState.UP:
                process.again = True
                self._effects.append(Stop(label))
            else:
                self._enter(process)
        return self._done()

    def stop(self, reason: str, now: float, *, insist: bool = True) -> list[Effect]:
        """End the launch; a second time, a moment later, kill what is left, if that is insisted on."""
        self._now = now
        if not self.stopping:
            self._reactions.add(self._stop_all(reason))
        elif insist and now - self._stopped_at >= FORCE_STOP_AFTER_SEC:
            self._effects.append(ForceStopAll())
            self._reactions.abandon()
        return self._done()

    def tick(self, now: float) -> list[Effect]:
        """Time has passed."""
        self._now = now
        for act in self._schedule.due(now):
            act(now)
        if self.stopping and now >= self._stopped_at + LAST_FUNCTION_SEC:
            self._reactions.abandon()
        return self._done()

    # What is done

    def _done(self) -> list[Effect]:
        """Return what is to be done; a launch that has nothing left to do ends."""
        busy = self._table.living or self._schedule.holding or self._reactions.waiting
        if not (self.stopping or busy or self._keep):
            self._reactions.add(self._stop_all("nothing is left to run"))
        effects = self._effects[:]
        self._effects.clear()
        return effects

    def _notify(self, event: Event) -> None:
        self._effects.append(Notify(event))

    def _happen(self, event: Event) -> None:
        """Tell of an event, and react to it."""
        self._notify(event)
        if not self._handlers.matching(event):
            return
        self._reactions.add_for_event(self._respond(event), event)

    # Reactions

    def _respond(self, event: Event) -> Reaction:
        """Do what handlers say about an event, in the order in which they were registered."""
        for handler in self._handlers.matching(event):
            yield from self._heed(handler, event)

    def _heed(self, handler: React, event: Event) -> Reaction:
        give = partial(handler.steps, event)
        answer = (yield Ask(give)) if handler.calls else Answer(give())
        if handler.once or answer.mistake:
            self._handlers.remove(handler)
        yield from self._follow(answer)

    def _follow(self, answer: Answer) -> Reaction:
        """Carry out what a function of the description has returned; if that was a mistake, end."""
        if answer.mistake:
            yield from self._fail(answer.mistake)
        yield from self._take(answer.steps)

    def _fail(self, mistake: str) -> Reaction:
        self.mistake = self.mistake or mistake
        self.failed = True
        self._notify(Message(Level.ERROR, mistake))
        yield from self._stop("the description has a mistake")

    def _take(self, steps: Sequence[Step]) -> Reaction:
        """Take steps: each when it is due. Handlers come first, so that they miss nothing."""
        for step in sorted(steps, key=lambda step: not isinstance(step, React)):
            if step.after_sec <= 0:
                yield from self._step(step)
            elif not self.stopping:
                self._schedule.add(self._now + step.after_sec, partial(self._step_is_due, step), holds=True)

    def _step_is_due(self, step: Step, now: float) -> None:
        del now
        self._reactions.add(self._step(step))

    def _step(self, step: Step) -> Reaction:
        match step:
            case Start():
                yield from self._start(step)
            case LogText():
                self._notify(Message(Level.WARN if step.warning else Level.INFO, step.text))
            case End():
                yield from self._stop(step.reason)
            case Call():
                yield from self._follow((yield Ask(step.steps)))
            case ChangeStates():
                yield from self._change_states(step)
            case React():
                yield from self._register(step)

    def _change_states(self, step: ChangeStates) -> Reaction:
        nodes = [each.spec for each in self._table.alive() if each.spec.lifecycle is not None]
        if step.calls:  # it is carried out when the function has chosen

            def choose() -> list[Step]:
                chosen = {each.label for each in nodes if step.matches(each)}

                def is_chosen(spec: ProcessSpec) -> bool:
                    return spec.label in chosen

                return [replace(step, matches=is_chosen, calls=False)]

            yield from self._follow((yield Ask(choose)))
            return
        meant = [each for each in nodes if step.matches(each)]
        for spec in meant:
            self._transitions.add(spec, step.transitions)
        if not meant:
            self._notify(Message(Level.WARN, f"no transition is requested: {step.what} does not run"))

    def _register(self, handler: React) -> Reaction:
        if self._handlers.full:
            yield from self._fail(f"There are more than {MAX_HANDLERS} event handlers")
            return
        self._handlers.add(handler)
        if handler.split and not self._split:
            self._split = True
            for process in self._table.in_state(ProcessState.UP):
                if not process.split:
                    self._notify(Message(Level.WARN, UNSPLIT, process.spec.label))
        if handler.presence in self.presences:
            yield from self._heed(handler, Appeared(handler.presence))

    # The life of a process

    def _start(self, step: Start) -> Reaction:
        spec = step.process
        if self.stopping:
            return
        if self.state(spec.label) is not ProcessState.DEAD:
            self._notify(Message(Level.WARN, "runs already; it is not started a second time", spec.label))
            return
        process = self._table.add(spec, step.on_exit)
        if process is None:
            yield from self._fail(f"More than {MAX_PROCESSES} processes would run")
            return
        self._enter(process)

    def _enter(self, process: ProcessEntry) -> None:
        """Start a process, when what it depends on is there."""
        if process.missing(self.presences):
            self._wait(process)
            return
        self._table.move(process, ProcessState.UP, self._now)
        process.split = self._split or process.spec.output.splits
        self._failed_runs.discard(process.spec.label)  # its last run is this one now
        self._effects.append(Run(process.spec, process.split))

    def _wait(self, process: ProcessEntry) -> None:
        self._table.move(process, ProcessState.WAITING, self._now)
        self._remind(process, process.generation, self._now)
        deadline = self._now + process.spec.depends_timeout_sec
        if deadline < math.inf:
            self._schedule.add(deadline, partial(self._waited_enough, process, process.generation))

    def _remind(self, process: ProcessEntry, generation: int, now: float) -> None:
        if process.generation == generation:
            so_far_sec = now - process.since
            self._notify(ProcessWaits(process.spec, None, process.missing(self.presences), so_far_sec))
            later = now + max(so_far_sec, REMINDER_SEC)
            self._schedule.add(later, partial(self._remind, process, generation))

    def _waited_enough(self, process: ProcessEntry, generation: int, now: float) -> None:
        del now
        if process.generation == generation:
            missing = " and ".join(map(str, process.missing(self.presences)))
            reason = f"{missing} was not there within {process.spec.depends_timeout_sec:g} s"
            self._end(process, Outcome(normal=False, reason=reason))

    def _end(self, process: ProcessEntry, outcome: Outcome) -> None:
        """Report the end of a process, react to it, and decide what follows."""
        spec = process.spec
        lived_sec = self._now - process.since
        self._note_run(process, outcome)
        self._table.move(process, ProcessState.DEAD, self._now)
        self._transitions.ended(spec.label)
        pid, process.pid = process.pid, None
        event = ProcessExited(spec, pid, outcome)
        self._notify(event)
        self._reactions.add(self._after_end(process, process.generation, event, lived_sec))

    def _after_end(
        self, process: ProcessEntry, generation: int, event: ProcessExited, lived_sec: float
    ) -> Reaction:
        spec = process.spec
        yield from self._respond(event)
        if process.on_exit is not None:
            yield from self._heed(process.on_exit, event)
        if self._table.get(spec.label) is not process or process.generation != generation:
            return  # it has been started again meanwhile
        if not self.stopping:
            yield from self._go_on(process, event.outcome, lived_sec)
        if process.state is ProcessState.DEAD and (spec.made_later or not self._keep):
            self._table.drop(process)

    def _note_run(self, process: ProcessEntry, outcome: Outcome) -> None:
        """Remember whether a process failed. The end of one that the launch has interrupted says nothing."""
        interrupted = self.stopping or process.again
        if not (interrupted or outcome.normal) and len(self._failed_runs) < MAX_PROCESSES:
            self._failed_runs.add(process.spec.label)

    def _go_on(self, process: ProcessEntry, outcome: Outcome, lived_sec: float) -> Reaction:
        """See what comes after the end of a process."""
        spec = process.spec
        if process.again:
            process.again = False
            self._enter(process)
        elif (delay := process.respawn_delay(lived_sec)) is not None:
            self._table.move(process, ProcessState.RESTARTING, self._now)
            self._notify(ProcessRestarts(spec, None, delay, "respawn"))
            self._schedule.add(self._now + delay, partial(self._respawn, process, process.generation))
        elif spec.required and (outcome.normal or not self._keep):
            self.failed = self.failed or not outcome.normal
            reason = spec.end_reason and f"{spec.label} has ended: {spec.end_reason}"
            yield from self._stop(reason or f"{spec.label} is required and has ended")

    def _respawn(self, process: ProcessEntry, generation: int, now: float) -> None:
        del now
        if process.generation == generation:
            self._enter(process)

    def _stop(self, reason: str) -> Reaction:
        if not self.stopping:
            yield from self._stop_all(reason)

    def _stop_all(self, reason: str) -> Reaction:
        """Stop everything, now, and return the reactions to that."""
        event = ShuttingDown(reason)
        self.stopping = True
        self._stopped_at = self._now
        self._schedule.clear()
        self._notify(event)
        for state in (ProcessState.WAITING, ProcessState.RESTARTING):
            for process in self._table.in_state(state):
                self._table.move(process, ProcessState.DEAD, self._now)
        self._transitions.abandon()
        self._effects.append(StopAll())
        return self._respond(event)
