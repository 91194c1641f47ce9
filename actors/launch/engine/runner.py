"""The runner: carries out what the machine decides, and tells it what happens.

What happens is a callback of a process, of the timer or of the graph; only the caller of `run` waits.
"""

from __future__ import annotations

import asyncio
import contextvars
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from actors.launch.engine.handlers import ask
from actors.launch.engine.machine import Ask, HurryAll, Run, Stop, StopAll, Tell
from actors.launch.engine.node_execution import NodeExecution
from actors.launch.engine.process import LaunchedProcess
from actors.launch.engine.worker import call_in_thread
from actors.launch.planning.events import Event, Level, Message
from actors.processes.guard import Guard

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.engine.handlers import Answer
    from actors.launch.engine.machine import Effect, Machine
    from actors.launch.planning.events import Listener, Stream
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.steps import ProcessSpec, Step
    from actors.processes.execution import Execution
    from actors.processes.outcome import Outcome


class Runner:
    """Runs a launch, once.

    Args:
        machine: What decides.
        listeners: Told of each event when it happens.
        stop_timeout_sec: What a process may take after SIGINT before it gets SIGTERM, and after that before
            it gets SIGKILL, if it says nothing else. All are stopped at the same time.
    """

    def __init__(self, machine: Machine, listeners: Sequence[Listener], *, stop_timeout_sec: float) -> None:
        self._machine = machine
        self._listeners = listeners
        self._stop_timeout_sec = stop_timeout_sec
        self._guard = Guard()
        self._executions: dict[str, Execution] = {}
        self._effects: deque[Effect] = deque()
        self._call: asyncio.Future[Answer] | None = None
        self._began = False
        self._stopped_before = False
        self._busy = False
        self._timer: asyncio.TimerHandle | None = None
        self._due: float | None = None
        self._over = asyncio.Event()
        self._failure: Exception | None = None
        self._loop: asyncio.AbstractEventLoop
        self._context: contextvars.Context

    async def run(self, steps: Sequence[Step]) -> bool:
        """Run to the end; return whether it succeeded. Cancelling it is `stop`.

        Args:
            steps: The plan.

        Raises:
            CancelledError: It was cancelled; all processes have ended all the same.
        """
        if self._stopped_before:
            return True
        self._began = True
        self._loop = asyncio.get_running_loop()
        self._context = contextvars.copy_context()
        self._happened(partial(self._machine.begin, steps))
        cancelled = await self._wait()
        if self._failure is not None:
            raise self._failure
        if cancelled is not None:
            raise cancelled
        return self._machine.succeeded

    def stop(self, reason: str, *, insist: bool = True) -> None:
        """Stop all processes; a second time, kill them, if that is insisted on. `run` returns then."""
        if not self._began:
            self._stopped_before = True
            return
        self._happened(partial(self._machine.stop, reason, insist=insist))

    def restart(self, label: str, reason: str) -> None:
        """Start a process again, whatever it does now."""
        self._happened(partial(self._machine.restart, label, reason))

    def graph(self, presences: set[Presence]) -> None:
        """This is there now."""
        self._happened(partial(self._machine.graph, frozenset(presences)))

    def tell(self, event: Event) -> None:
        """Tell the listeners of something."""
        for listener in self._listeners:
            listener(event)

    async def _wait(self) -> asyncio.CancelledError | None:
        """Wait until everything has ended, and return whether this was cancelled meanwhile."""
        cancelled: asyncio.CancelledError | None = None
        while not self._over.is_set():
            try:
                await self._over.wait()
            except asyncio.CancelledError as error:
                cancelled = error
                self.stop("interrupted")
        if self._call is not None:
            self._call.cancel()
        closing = self._loop.create_task(self._guard.close(), name="launch guard")
        while not closing.done():
            try:
                await asyncio.shield(closing)
            except asyncio.CancelledError as error:
                cancelled = error
        return cancelled

    def _happened(self, tell: Callable[[float], list[Effect]]) -> None:
        """Tell the machine that something has happened, and do what it says."""
        if self._over.is_set():
            return
        try:
            self._effects += tell(self._loop.time())
            if self._busy:  # a listener has made it happen; first what was said before
                return
            self._busy = True
            try:
                while self._effects:
                    self._do(self._effects.popleft())
            finally:
                self._busy = False
            self._set_timer()
        except Exception as error:  # noqa: BLE001 - it is raised to whoever runs the launch
            self._broken(error)
        if not self._executions and (self._machine.over or self._failure is not None):
            self._over.set()

    def _do(self, effect: Effect) -> None:
        match effect:
            case Tell():
                self.tell(effect.event)
            case Run():
                if self._failure is None:
                    self._start(effect.process, split=effect.split)
            case Stop():
                self._executions[effect.label].stop()
            case StopAll():
                for execution in tuple(self._executions.values()):
                    execution.stop()
            case Ask():
                self._call = call_in_thread(partial(ask, effect.give), self._context)
                self._call.add_done_callback(partial(self._answered, effect))
            case HurryAll():
                for execution in tuple(self._executions.values()):
                    execution.hurry()

    def _start(self, spec: ProcessSpec, *, split: bool) -> None:
        label = spec.label

        def if_known(tell: Callable[[float], list[Effect]]) -> None:
            # One that could not be stopped has been given up, and may still have its say.
            if self._executions.get(label) is execution:
                self._happened(tell)

        def started() -> None:
            if_known(partial(self._machine.started, label, execution.pid))

        def wrote(stream: Stream, lines: Sequence[bytes]) -> None:
            if_known(partial(self._machine.wrote, label, stream, lines))

        def say(level: Level, text: str) -> None:
            self.tell(Message(level, text, label))

        def ended(outcome: Outcome) -> None:
            if self._executions.get(label) is execution:
                del self._executions[label]
                self._happened(partial(self._machine.ended, label, outcome))

        told: dict[str, Any] = {
            "write": wrote,
            "say": say,
            "on_started": started,
            "on_ended": ended,
            "stop_timeout_sec": self._stop_timeout_sec,
        }
        execution: Execution
        if spec.program is None:
            execution = LaunchedProcess(spec, self._guard, split=split, **told)
        else:
            execution = NodeExecution(spec, **told)
        self._executions[label] = execution
        execution.start(self._context)

    def _answered(self, effect: Ask, answer: asyncio.Future[Answer]) -> None:
        if not answer.cancelled():
            self._happened(lambda now: self._machine.answered(effect, answer.result(), now))

    def _set_timer(self) -> None:
        due = self._machine.wake_at if self._failure is None else None
        if due == self._due:  # as after all that processes write
            return
        self._due = due
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if due is not None:
            self._timer = self._loop.call_at(due, self._time_has_come, due)

    def _time_has_come(self, due: float) -> None:
        self._timer = self._due = None
        # A loop may call a little early; for the machine it is time.
        self._happened(lambda now: self._machine.tick(max(now, due)))

    def _broken(self, error: Exception) -> None:
        """Something here has failed, and the machine may not know what runs: stop it all."""
        self._failure = self._failure or error
        self._effects.clear()
        self._set_timer()
        for execution in tuple(self._executions.values()):
            execution.stop()
