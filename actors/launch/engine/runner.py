"""Carries out the effects of the machine, and reports events to it."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any

from actors.launch.engine import effects
from actors.launch.engine.handlers import call_function
from actors.launch.engine.node_execution import NodeExecution
from actors.launch.engine.process import LaunchedProcess
from actors.launch.engine.worker import call_in_thread
from actors.launch.planning.events import Message, StateTransition
from actors.processes.driver import Driver

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.config.contexts import BrokerTarget
    from actors.interfaces.lifecycle_msgs.msg import TransitionEvent
    from actors.launch.engine.handlers import FunctionResult
    from actors.launch.engine.machine import Machine
    from actors.launch.engine.transition_client import TransitionClient
    from actors.launch.planning.events import Event, Level, Listener, Stream
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.launch.planning.steps import Step
    from actors.processes.execution import Execution
    from actors.processes.outcome import Outcome


class Runner:
    """Runs a launch, once.

    Args:
        machine: The state machine.
        listeners: Called with each event when it happens.
        target: The broker of its lifecycle nodes, and the number of its graph.
        node_name: The beginning of the names of its hidden nodes.
        stop_timeout_sec: Seconds between SIGINT and SIGTERM, and between SIGTERM and SIGKILL, for processes
            without timeouts of their own. All processes are stopped at the same time.
    """

    def __init__(
        self,
        machine: Machine,
        listeners: Sequence[Listener],
        *,
        target: BrokerTarget,
        node_name: str,
        stop_timeout_sec: float,
    ) -> None:
        self._machine = machine
        self._listeners = listeners
        self._target = target
        self._node_name = node_name
        self._stop_timeout_sec = stop_timeout_sec
        self._driver: Driver[effects.Effect] = Driver(machine, self._perform)
        self._call: asyncio.Future[FunctionResult] | None = None
        self._transitions: TransitionClient | None = None
        self._began = False
        self._stopped_before = False

    async def run(self, steps: Sequence[Step]) -> bool:
        """Run to the end; return whether it succeeded. Cancelling it is `stop`.

        Args:
            steps: The plan.

        Raises:
            CancelledError: It was cancelled; all processes have ended nevertheless.
        """
        if self._stopped_before:
            return True  # while it was planned, or while a broker was being found
        self._began = True
        self._driver.begin(partial(self._machine.begin, steps))
        cancelled = await self._driver.wait(partial(self.stop, "interrupted"))
        # The thread of the function cannot be stopped; in it, `abandoned()` is true now.
        if self._call is not None:
            self._call.cancel()
        if self._transitions is not None:
            await self._transitions.close()
        if self._driver.failure is not None:
            raise self._driver.failure
        # Only now: the processes had to end first.
        if cancelled:
            raise asyncio.CancelledError
        return self._machine.succeeded

    def stop(self, reason: str, *, escalate: bool = True) -> None:
        """Stop all processes; a second time, kill them, unless `escalate` is False. `run` returns then."""
        if not self._began:
            self._stopped_before = True
            return
        self._driver.happened(partial(self._machine.stop, reason, escalate=escalate))

    def restart(self, label: str, reason: str) -> None:
        """Start a process again, whatever its state."""
        self._driver.happened(partial(self._machine.restart, label, reason))

    def graph(self, presences: set[Presence]) -> None:
        """Report all nodes, topics and services that are in the graph now."""
        self._driver.happened(partial(self._machine.graph, frozenset(presences)))

    def notify(self, event: Event) -> None:
        """Pass an event to the listeners."""
        for listener in self._listeners:
            listener(event)

    def _perform(self, effect: effects.Effect) -> None:
        match effect:
            case effects.Notify():
                self.notify(effect.event)
            case effects.Run():
                self._start(effect.process, split=effect.split)
            case effects.Stop():
                self._driver.executions[effect.label].stop()
            case effects.StopAll():
                self._driver.stop_all()
            case effects.ForceStopAll():
                self._driver.force_stop_all()
            case effects.CallFunction():
                # The driver's context: variables that the function sets must not leak into the launch.
                self._call = call_in_thread(partial(call_function, effect.call), self._driver.context)
                self._call.add_done_callback(partial(self._function_returned, effect))
            case effects.RequestTransition():
                self._transition_client().request(effect)
            case effects.CancelTransition():
                self._transition_client().cancel(effect.request)

    def _start(self, spec: ProcessSpec, *, split: bool) -> None:
        label, driver = spec.label, self._driver

        def if_current(transition: Callable[[float], list[effects.Effect]]) -> None:
            # An execution that could not be stopped has been abandoned, and may still report.
            if driver.executions.get(label) is execution:
                driver.happened(transition)

        def started() -> None:
            if_current(partial(self._machine.started, label, execution.pid))

        def wrote(stream: Stream, lines: Sequence[bytes]) -> None:
            if_current(partial(self._machine.wrote, label, stream, lines))

        def on_message(level: Level, text: str) -> None:
            self.notify(Message(level, text, label))

        def ended(outcome: Outcome) -> None:
            if driver.executions.get(label) is execution:
                del driver.executions[label]
                driver.happened(partial(self._machine.ended, label, outcome))

        reports: dict[str, Any] = {
            "write": wrote,
            "on_message": on_message,
            "on_started": started,
            "on_ended": ended,
            "stop_timeout_sec": self._stop_timeout_sec,
        }
        # Before the start, so that no transition is missed.
        if spec.lifecycle is not None:
            self._transition_client().watch(spec)
        execution: Execution
        if spec.program is None:
            execution = LaunchedProcess(spec, driver.guard, split=split, **reports)
        else:
            execution = NodeExecution(spec, **reports)
        driver.start(label, execution)

    def _transition_client(self) -> TransitionClient:
        """Return the client of lifecycle nodes; a launch without such nodes needs none."""
        if self._transitions is None:
            from actors.launch.engine.transition_client import TransitionClient  # noqa: PLC0415

            self._transitions = TransitionClient(
                self._target,
                f"{self._node_name}_lifecycle",
                self._driver.context,
                on_event=self._state_changed,
                on_answer=self._transition_ended,
            )
        return self._transitions

    def _state_changed(self, process: ProcessSpec, event: TransitionEvent) -> None:
        execution = self._driver.executions.get(process.label)
        found = StateTransition(
            process,
            None if execution is None else execution.pid,
            transition=event.transition.label,
            start_state=event.start_state.label,
            goal_state=event.goal_state.label,
            timestamp=event.timestamp,
        )
        self._driver.happened(partial(self._machine.state_changed, found))

    def _transition_ended(self, request: effects.RequestTransition, failure: str | None) -> None:
        self._driver.happened(partial(self._machine.transition_ended, request, failure))

    def _function_returned(
        self, effect: effects.CallFunction, result: asyncio.Future[FunctionResult]
    ) -> None:
        if not result.cancelled():
            self._driver.happened(lambda now: self._machine.function_returned(effect, result.result(), now))
