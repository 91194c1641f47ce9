"""The state machine of a launch: decides what to do next. No I/O and no clock.

The runner calls a method for each event (`started`, `ended`, `graph`, `tick`, `stop`, …) with the time; it
returns effects, which the runner carries out in order. `tick` is due at `wake_at`. The launch is `finished`
when nothing runs and nothing will be started.

Functions of the description may block, so the runner calls them in a thread: `CallFunction`, then
`function_returned`. Events that happen meanwhile are reported at once, but handled afterwards: reactions are
generators, which run one after the other in the order of their events. So the result does not depend on how
long a function takes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.launch.engine.effects import CallFunction, ForceStopAll, Notify, Run, Stop, StopAll
from actors.launch.engine.handlers import MAX_HANDLERS, FunctionResult, Handlers, ReactionQueue
from actors.launch.engine.process_table import ProcessState, ProcessTable
from actors.launch.engine.schedule import Schedule
from actors.launch.engine.transition_queue import TransitionQueue
from actors.launch.planning import events
from actors.launch.planning.process_spec import MAX_PROCESSES, ProcessSpec
from actors.launch.planning.steps import (
    AddHandler,
    Call,
    ChangeStates,
    End,
    LogText,
    Start,
    splits_streams,
)
from actors.processes.outcome import Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.engine.effects import Effect, RequestTransition
    from actors.launch.engine.handlers import Reaction
    from actors.launch.engine.process_table import ProcessEntry
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.steps import Step

REMINDER_SEC: Final = 10.0
"""When a process that still waits is reported again; then after twice, four times … as long."""
REPEATED_STOP_SEC: Final = 0.2
"""Two requests to stop within this time count as one: `timeout` and terminals may signal twice."""
LAST_FUNCTION_SEC: Final = 5.0
"""How long a function of the description may go on when the launch ends; its result is ignored then."""
UNSPLIT: Final = "stdout and stderr share one stream here; handlers for one of them are not called"


class Machine:
    """The state of a launch.

    Args:
        keep: Whether the launch goes on when nothing is left to run, or a required process has died, because
            `restart` can start processes again.

    Attributes:
        presences: The nodes, topics and services in the graph, as last reported.
        stopping: Whether the launch is ending.
        failed: Whether a required process has died, or an error was found in the description.
        error: The first error that was found in the description while it ran; empty if there is none.
    """

    def __init__(self, *, keep: bool = False) -> None:
        self.presences: frozenset[Presence] = frozenset()
        self.stopping = False
        self.failed = False
        self.error = ""
        self._keep = keep
        self._split = False
        self._table = ProcessTable()
        self._handlers = Handlers()
        self._schedule = Schedule()
        # Labels whose last run has failed. The next run removes its label, so a crash does not
        # fail the launch if a run after it succeeds.
        self._failed_runs: set[str] = set()
        # The time of the event that is being handled, so that helpers need no argument for it.
        self._now = 0.0
        self._stopped_at = 0.0
        self._function_deadline = 0.0
        self._effects: list[Effect] = []
        self._reactions = ReactionQueue(self._effects.append, self._notify)
        self._transitions = TransitionQueue(self._effects.append, self._notify)

    @property
    def succeeded(self) -> bool:
        """Whether neither the launch nor the last run of any process has failed."""
        return not self.failed and not self._failed_runs

    @property
    def finished(self) -> bool:
        """Whether the launch has ended: nothing runs, and nothing will be started."""
        # A function of `OnShutdown` may still run: what it logs and returns belongs to the launch.
        busy = self._table.living or self._schedule.keeping_alive or self._reactions.waiting
        return self.stopping and not busy

    @property
    def wake_at(self) -> float | None:
        """When `tick` is due; None: not before another event."""
        due = self._schedule.next_at
        if self.stopping and self._reactions.waiting:
            return self._function_deadline if due is None else min(self._function_deadline, due)
        return due

    def state(self, label: str) -> ProcessState:
        """Return the state of a process; one that has been forgotten is dead."""
        process = self._table.get(label)
        return ProcessState.DEAD if process is None else process.state

    # Events

    def begin(self, steps: Sequence[Step], now: float) -> list[Effect]:
        """Begin to carry out the steps of a plan."""
        self._now = now
        # Before the first start: streams that a process has shared cannot be separated later.
        self._split = splits_streams(steps)
        self._reactions.add(self._run_steps(steps))
        return self._pop_effects()

    def started(self, label: str, pid: int | None, now: float) -> list[Effect]:
        """Handle that a process runs."""
        self._now = now
        process = self._table[label]
        process.pid = pid
        # Handlers first: a transition that they request comes after the autostart all the same.
        self._dispatch(events.ProcessStarted(process.spec, pid))
        self._transitions.started(process.spec)
        return self._pop_effects()

    def wrote(self, label: str, stream: events.Stream, lines: Sequence[bytes], now: float) -> list[Effect]:
        """Handle lines that a process has written."""
        self._now = now
        process = self._table[label]
        self._dispatch(events.ProcessIO(process.spec, process.pid, stream, tuple(lines)))
        return self._pop_effects()

    def ended(self, label: str, outcome: Outcome, now: float) -> list[Effect]:
        """Handle that a process has ended, or could not be started."""
        self._now = now
        self._end(self._table[label], outcome)
        return self._pop_effects()

    def function_returned(self, call: CallFunction, result: FunctionResult, now: float) -> list[Effect]:
        """Handle the result of a function of the description."""
        self._now = now
        self._reactions.function_returned(call, result)
        return self._pop_effects()

    def state_changed(self, event: events.StateTransition, now: float) -> list[Effect]:
        """Handle a step of a lifecycle node's transition."""
        self._now = now
        self._dispatch(event)
        return self._pop_effects()

    def transition_ended(self, request: RequestTransition, failure: str | None, now: float) -> list[Effect]:
        """Handle the end of a requested transition: None if it succeeded, otherwise the reason."""
        self._now = now
        self._transitions.request_ended(request, failure)
        return self._pop_effects()

    def graph(self, presences: frozenset[Presence], now: float) -> list[Effect]:
        """Handle a new state of the graph: all nodes, topics and services that are there."""
        self._now = now
        new = presences - self.presences
        self.presences = presences
        # Sorted: the order of a set would make launches differ from run to run.
        for each in sorted(new, key=str):
            self._dispatch(events.Appeared(each))
        for process in self._table.in_state(ProcessState.WAITING):
            if not process.missing(presences):
                self._start_when_ready(process)
        return self._pop_effects()

    def restart(self, label: str, reason: str, now: float) -> list[Effect]:
        """Start a process again, whatever its state; one that waits to be started goes on waiting."""
        self._now = now
        process = self._table.get(label)
        # One that waits for dependencies or for its end is started with the new sources anyway.
        waits = process is not None and (process.state is ProcessState.WAITING or process.restart_pending)
        if process is not None and not waits and not self.stopping:
            self._notify(events.ProcessRestarts(process.spec, process.pid, 0.0, reason))
            process.reset_respawns()  # it has been repaired: its crashes until now do not count
            if process.state is ProcessState.UP:
                process.restart_pending = True
                self._effects.append(Stop(label))
            else:
                self._start_when_ready(process)
        return self._pop_effects()

    def stop(self, reason: str, now: float, *, escalate: bool = True) -> list[Effect]:
        """End the launch. A second call, a moment later, kills what is left, unless `escalate` is False."""
        self._now = now
        if not self.stopping:
            self._reactions.add(self._stop_all(reason))
        # `timeout` and terminals may signal twice for one request; that must not kill.
        elif escalate and now - self._stopped_at >= REPEATED_STOP_SEC:
            self._schedule.shut_down(force=True)
            self._effects.append(ForceStopAll())
            self._reactions.abandon()
        return self._pop_effects()

    def tick(self, now: float) -> list[Effect]:
        """Carry out what is due."""
        self._now = now
        for callback in self._schedule.due(now):
            callback(now)
        if self.stopping and self._reactions.waiting and now >= self._function_deadline:
            self._reactions.abandon()
        return self._pop_effects()

    # Effects

    def _pop_effects(self) -> list[Effect]:
        """Return the effects of this event; end a launch that has nothing left to do."""
        # Timers that only remind or give up belong to waiting processes, which are alive themselves.
        busy = self._table.living or self._schedule.keeping_alive or self._reactions.waiting
        if not (self.stopping or busy or self._keep):
            self._reactions.add(self._stop_all("nothing is left to run"))
        effects = self._effects[:]
        self._effects.clear()
        return effects

    def _notify(self, event: events.Event) -> None:
        self._effects.append(Notify(event))

    def _warn(self, text: str, about: str = "launch") -> None:
        self._notify(events.Message(events.Level.WARN, text, about))

    def _dispatch(self, event: events.Event) -> None:
        """Report an event, and react to it."""
        # Reports come first, so that the cause of a message is above it.
        self._notify(event)
        # Most events, such as each line of output, have no handler; they need no place in the queue.
        if not self._handlers.matching(event):
            return
        self._reactions.add_for_event(self._respond(event), event)

    # Reactions

    def _respond(self, event: events.Event) -> Reaction:
        """Run the handlers of an event, in the order in which they were registered."""
        for handler in self._handlers.matching(event):
            yield from self._run_handler(handler, event)

    def _run_handler(self, handler: AddHandler, event: events.Event) -> Reaction:
        get_steps = partial(handler.steps, event)
        result = (yield CallFunction(get_steps)) if handler.calls else FunctionResult(get_steps())
        # One that has failed would fail again at the next event, and hide the first error.
        if handler.once or result.error:
            self._handlers.remove(handler)
        yield from self._run_result(result)

    def _run_result(self, result: FunctionResult) -> Reaction:
        """Carry out the steps that a function has returned; if it failed, end the launch."""
        if result.error:
            yield from self._fail(result.error)
        yield from self._run_steps(result.steps)

    def _fail(self, error: str) -> Reaction:
        self.error = self.error or error
        self.failed = True
        self._notify(events.Message(events.Level.ERROR, error))
        yield from self._stop("the description has an error")

    def _run_steps(self, steps: Sequence[Step]) -> Reaction:
        """Carry out steps, each when it is due. Handlers are added first, so that they miss no event."""
        for step in sorted(steps, key=lambda step: not isinstance(step, AddHandler)):
            if step.after_sec <= 0:
                yield from self._run_step(step)
            elif not self.stopping:
                self._schedule.add(
                    self._now + step.after_sec,
                    partial(self._step_is_due, step),
                    keep_alive=True,
                    cancel_on_shutdown=step.cancel_on_shutdown,
                )

    def _step_is_due(self, step: Step, now: float) -> None:
        # After the shutdown, that of a timer which survives it: its function gets as much time as one of
        # then.
        self._function_deadline = now + LAST_FUNCTION_SEC
        self._reactions.add(self._run_step(step))

    def _run_step(self, step: Step) -> Reaction:
        match step:
            case Start():
                yield from self._start(step)
            case LogText():
                level = events.Level.WARN if step.warning else events.Level.INFO
                self._notify(events.Message(level, step.text))
            case End():
                yield from self._stop(step.reason)
            case Call():
                yield from self._run_result((yield CallFunction(step.steps)))
            case ChangeStates():
                yield from self._change_states(step)
            case AddHandler():
                yield from self._register(step)

    def _change_states(self, step: ChangeStates) -> Reaction:
        nodes = [each.spec for each in self._table.alive() if each.spec.lifecycle is not None]
        if step.calls:  # the function is called for each node in a thread; then this step is carried out

            def filter_nodes() -> list[Step]:
                matching = {each.label for each in nodes if step.matches(each)}

                def matches(spec: ProcessSpec) -> bool:
                    return spec.label in matching

                return [replace(step, matches=matches, calls=False)]

            yield from self._run_result((yield CallFunction(filter_nodes)))
            return
        matching = [each for each in nodes if step.matches(each)]
        for spec in matching:
            self._transitions.add(spec, step.transitions)
        if not matching:
            self._warn(f"no transition is requested: {step.what} does not run")

    def _register(self, handler: AddHandler) -> Reaction:
        if self._handlers.full:
            yield from self._fail(f"There are more than {MAX_HANDLERS} event handlers")
            return
        self._handlers.add(handler)
        # A handler that a function returns late finds processes whose streams are one already.
        if handler.split and not self._split:
            self._split = True
            for process in self._table.in_state(ProcessState.UP):
                if not process.split:
                    self._warn(UNSPLIT, process.spec.label)
        # It may be there already. No event will report that again.
        if handler.presence in self.presences:
            yield from self._run_handler(handler, events.Appeared(handler.presence))

    # The life of a process

    def _start(self, step: Start) -> Reaction:
        spec = step.process
        if self.stopping:
            return  # of `OnShutdown`: nothing is started after it
        # The same action can be returned by a function again and again.
        if self.state(spec.label) is not ProcessState.DEAD:
            self._warn("runs already; it is not started a second time", spec.label)
            return
        process = self._table.add(spec, step.on_exit)
        if process is None:
            yield from self._fail(f"More than {MAX_PROCESSES} processes would run")
            return
        self._start_when_ready(process)

    def _start_when_ready(self, process: ProcessEntry) -> None:
        """Start a process, or wait for its dependencies."""
        if process.missing(self.presences):
            self._wait(process)
            return
        self._table.move(process, ProcessState.UP, self._now)
        process.split = self._split or process.spec.output.splits
        self._failed_runs.discard(process.spec.label)  # this run is its last one now
        self._effects.append(Run(process.spec, process.split))

    def _wait(self, process: ProcessEntry) -> None:
        self._table.move(process, ProcessState.WAITING, self._now)
        # Timers are not removed when the process moves on. The generation tells them that they are outdated.
        self._remind(process, process.generation, self._now)
        deadline = self._now + process.spec.depends_timeout_sec
        if deadline < math.inf:
            self._schedule.add(deadline, partial(self._give_up_waiting, process, process.generation))

    def _remind(self, process: ProcessEntry, generation: int, now: float) -> None:
        if process.generation == generation:
            so_far_sec = now - process.since
            self._notify(events.ProcessWaits(process.spec, None, process.missing(self.presences), so_far_sec))
            later = now + max(so_far_sec, REMINDER_SEC)
            self._schedule.add(later, partial(self._remind, process, generation))

    def _give_up_waiting(self, process: ProcessEntry, generation: int, now: float) -> None:
        del now
        if process.generation == generation:
            missing = " and ".join(map(str, process.missing(self.presences)))
            reason = f"{missing} was not there within {process.spec.depends_timeout_sec:g} s"
            self._end(process, Outcome(normal=False, reason=reason))

    def _end(self, process: ProcessEntry, outcome: Outcome) -> None:
        """Report the end of a process, react to it, and restart it or end the launch if that is due."""
        spec = process.spec
        # Before `move`, which sets `since`.
        lived_sec = self._now - process.since
        self._record_outcome(process, outcome)
        self._table.move(process, ProcessState.DEAD, self._now)
        self._transitions.ended(spec.label)
        pid, process.pid = process.pid, None
        event = events.ProcessExited(spec, pid, outcome)
        self._notify(event)
        self._reactions.add(self._after_end(process, process.generation, event, lived_sec))

    def _after_end(
        self, process: ProcessEntry, generation: int, event: events.ProcessExited, lived_sec: float
    ) -> Reaction:
        spec = process.spec
        # Handlers come before the respawn: if one of them ends the launch, nothing is started any more.
        yield from self._respond(event)
        if process.on_exit is not None:
            yield from self._run_handler(process.on_exit, event)
        if self._table.get(spec.label) is not process or process.generation != generation:
            return  # it has been started again meanwhile
        if not self.stopping:
            yield from self._restart_or_finish(process, event.outcome, lived_sec)
        # `restart` (of --watch) needs those of the file; what functions return would pile up.
        if process.state is ProcessState.DEAD and (spec.made_later or not self._keep):
            self._table.drop(process)

    def _record_outcome(self, process: ProcessEntry, outcome: Outcome) -> None:
        """Remember whether the last run of a process failed. One that the launch interrupted has not."""
        # Programs answer SIGINT with any exit code; that says nothing about them.
        interrupted = self.stopping or process.restart_pending
        if not (interrupted or outcome.normal) and len(self._failed_runs) < MAX_PROCESSES:
            self._failed_runs.add(process.spec.label)

    def _restart_or_finish(self, process: ProcessEntry, outcome: Outcome, lived_sec: float) -> Reaction:
        """Start a process again, or end the launch if it was required."""
        spec = process.spec
        if process.restart_pending:
            process.restart_pending = False
            self._start_when_ready(process)
        elif (delay := process.respawn_delay(lived_sec)) is not None:
            self._table.move(process, ProcessState.RESTARTING, self._now)
            self._notify(events.ProcessRestarts(spec, None, delay, "respawn"))
            self._schedule.add(self._now + delay, partial(self._respawn, process, process.generation))
        # With --watch, one that has died is to be repaired and saved: that starts it again.
        elif spec.required and (outcome.normal or not self._keep):
            self.failed = self.failed or not outcome.normal
            reason = spec.end_reason and f"{spec.label} has ended: {spec.end_reason}"
            yield from self._stop(reason or f"{spec.label} is required and has ended")

    def _respawn(self, process: ProcessEntry, generation: int, now: float) -> None:
        del now
        if process.generation == generation:
            self._start_when_ready(process)

    def _stop(self, reason: str) -> Reaction:
        if not self.stopping:
            yield from self._stop_all(reason)

    def _stop_all(self, reason: str) -> Reaction:
        """Stop all processes, and return the reactions to the shutdown.

        The state changes at once, and not when the reaction is carried out, so that nothing is started
        between the request and that.
        """
        event = events.ShuttingDown(reason)
        self.stopping = True
        self._stopped_at = self._now
        self._function_deadline = self._now + LAST_FUNCTION_SEC
        self._schedule.shut_down()
        self._notify(event)
        for state in (ProcessState.WAITING, ProcessState.RESTARTING):
            for process in self._table.in_state(state):
                self._table.move(process, ProcessState.DEAD, self._now)
        self._transitions.abandon()
        self._effects.append(StopAll())
        return self._respond(event)
