"""The supervisor: starts children, restarts those that die, and stops them all when it ends.

`RestartPlan` decides what to start and stop; an `Execution` runs one child and stops it. The supervisor
connects them, through a `Driver`, and publishes events. Everything is a callback of an execution or of the
timer; only `run`, leaving the context and watchers wait.
"""

from __future__ import annotations

import asyncio
import random
import time
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Self

from actors.errors import SupervisorGaveUp, WaitTimeout
from actors.logging.logger import get_logger
from actors.processes.child import Child, Strategy
from actors.processes.child_events import ChildEvent, ChildEventKind
from actors.processes.driver import Driver
from actors.processes.event_publisher import EventPublisher
from actors.processes.execution import TaskExecution
from actors.processes.process_execution import ProcessExecution
from actors.processes.restart_plan import (
    ChildState,
    GaveUp,
    Policy,
    RestartPlan,
    Start,
    Step,
    Stop,
    WillRestart,
)
from actors.processes.state_waits import StateWaits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from types import TracebackType

    from actors.node.node import Node
    from actors.processes.child_events import ChildEvents
    from actors.processes.execution import Execution
    from actors.processes.outcome import Outcome


@dataclass(frozen=True, kw_only=True)
class ChildStatus:
    """A child as it is now.

    Attributes:
        name: Its name.
        state: Its state.
        pid: The id of its process while it runs; None for others.
        restarts: How often it has been restarted.
        uptime_sec: How long it has run since its last start; 0 if it does not run.
        outcome: How it ended last; None if it never has.
    """

    name: str
    state: ChildState
    pid: int | None
    restarts: int
    uptime_sec: float
    outcome: Outcome | None


class _Member:
    """A child, and its latest run."""

    __slots__ = ("child", "outcome", "running_since")

    def __init__(self, child: Child) -> None:
        self.child = child
        self.outcome: Outcome | None = None
        self.running_since: float | None = None


class Supervisor:
    """Runs children, and restarts those that die.

    `await supervisor.run()` runs until all children have ended for good. `async with supervisor:` begins to
    start them, and stops them in the end. They are started in order and stopped in reverse order, one after
    the other, so that stopping takes at most the sum of their time limits (`Child.stop_timeout_sec`). If the
    task is cancelled a second time, all are killed at once. A supervisor runs once.

    Args:
        children: The children, in start order.
        strategy: Which of them are restarted when one dies.
        max_restarts: Restarts allowed within `restart_window_sec`. If one more is due, the supervisor stops
            all children and ends with SupervisorGaveUp.
        restart_window_sec: Length of that window, in seconds.
        first_backoff_sec: Least time from a child's death to its restart. It doubles with each further death
            (and varies by up to a half, so that many do not come back at the same time), until the child has
            lived twice `max_backoff_sec`.
        max_backoff_sec: The upper limit of this time.
        name: For logs, errors and events.
        node: Publishes all events on `~/child_events`, latched, as `ChildEventMessage`. The caller runs it.
        jitter: Gives a random factor between 0 and 1 for the back-off.
        max_seconds: The former name of `restart_window_sec`, for one version.

    Raises:
        ValueError: A number is out of range, or two children have the same name.
    """

    def __init__(
        self,
        children: Iterable[Child],
        *,
        strategy: Strategy = Strategy.ONE_FOR_ONE,
        max_restarts: int = 3,
        restart_window_sec: float = 5.0,
        first_backoff_sec: float = 0.1,
        max_backoff_sec: float = 5.0,
        name: str = "supervisor",
        node: Node | None = None,
        jitter: Callable[[], float] = random.random,
        max_seconds: float | None = None,
    ) -> None:
        if max_seconds is not None:
            text = "`max_seconds=` is called `restart_window_sec=`"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            restart_window_sec = max_seconds
        self.name = name
        self._members = [_Member(child) for child in children]
        self._index = {member.child.name: index for index, member in enumerate(self._members)}
        if len(self._index) < len(self._members):
            names = [member.child.name for member in self._members]
            twice = next(each for each in names if names.count(each) > 1)
            raise ValueError(f"Two children have the name '{twice}'")
        self._policy = Policy(
            strategy=strategy,
            max_restarts=max_restarts,
            restart_window_sec=restart_window_sec,
            first_backoff_sec=first_backoff_sec,
            max_backoff_sec=max_backoff_sec,
        )
        self._plan = RestartPlan((member.child.restart for member in self._members), self._policy, jitter)
        self._log = get_logger(name)
        self._driver: Driver[Step] = Driver(self._plan, self._perform, self._moved)
        self._publisher = EventPublisher(name, node)
        self._waits = StateWaits(self._plan.state)
        self._began = False
        self._closed = False
        self._caller: asyncio.Task[object] | None = None
        self._cancelled_caller: asyncio.Task[object] | None = None
        self._cancelling = 0

    # Watching

    def children(self) -> list[ChildStatus]:
        """Return the current status of all children, in start order."""
        now = self._driver.loop.time() if self._began else 0.0
        return [
            ChildStatus(
                name=member.child.name,
                state=self._plan.state(index),
                pid=self._pid(index),
                restarts=self._plan.restarts(index),
                uptime_sec=now - member.running_since if member.running_since is not None else 0.0,
                outcome=member.outcome,
            )
            for index, member in enumerate(self._members)
        ]

    def events(self) -> ChildEvents:
        """Return a watcher, to iterate over what happens from now on. It ends with the supervisor."""
        return self._publisher.watcher(ended=self._closed)

    async def wait_for(self, name: str, state: ChildState, timeout_sec: float | None = None) -> bool:
        """Wait until a child is in a state; ENDED means for good.

        Args:
            name: The child's name.
            state: Which state.
            timeout_sec: Seconds to wait at most; None for as long as the supervisor lives.

        Returns:
            True when it is in the state; False when the supervisor has ended before.

        Raises:
            WaitTimeout: It was not in the state within `timeout_sec`.
            ValueError: There is no such child.
        """
        if name not in self._index:
            raise ValueError(f"No child '{name}'; there is: {', '.join(self._index) or 'none'}")
        try:
            async with asyncio.timeout(timeout_sec):
                return await self._waits.wait(self._index[name], state)
        except TimeoutError as error:
            text = f"Child '{name}' was not {state.name} within {timeout_sec:g} s"
            raise WaitTimeout(text) from error

    # Running

    async def run(self) -> None:
        """Run until all children have ended for good, or the task is cancelled.

        Raises:
            SupervisorGaveUp: Too many restarts were due.
            RuntimeError: It has run already.
        """
        async with self:
            await self._driver.finished.wait()

    async def __aenter__(self) -> Self:
        """Begin to start the children; `wait_for` waits until one runs.

        Raises:
            RuntimeError: It has run already.
        """
        if self._began:
            raise RuntimeError(f"Supervisor '{self.name}' has run already; make a new one")
        self._began = True
        self._caller = asyncio.current_task()
        self._cancelling = self._caller.cancelling() if self._caller is not None else 0
        self._driver.begin(self._plan.begin)
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> Literal[False]:
        """Stop all children, the last one first."""
        self._caller = None
        self._driver.happened(self._plan.stop)
        try:
            cancelled = await self._driver.wait(self._force_stop)
        finally:
            self._closed = True
            self._publisher.end()
            self._waits.close()
        if self._cancelled_caller is not None and self._cancelled_caller.uncancel() > self._cancelling:
            cancelled = True  # another task has cancelled it, too, which must not be swallowed
        if cancelled:
            raise asyncio.CancelledError
        failure = self._driver.failure
        if failure is not None and (error is None or isinstance(error, asyncio.CancelledError)):
            raise failure
        return False

    def _force_stop(self) -> None:
        self._driver.happened(lambda _now: self._plan.force_stop())
        self._driver.force_stop_all()

    # Transitions

    def _moved(self) -> None:
        """Wake tasks that wait for a state and, after a failure, the task that runs the supervisor."""
        if self._driver.failure is not None and self._caller is not None and self._cancelled_caller is None:
            self._caller.cancel()
            self._cancelled_caller = self._caller
        self._waits.check()

    def _perform(self, step: Step) -> None:
        match step:
            case Start(child):
                self._start(child)
            case Stop(child):
                self._driver.executions[child].stop()
            case WillRestart(child, delay):
                self._notify(child, ChildEventKind.RESTARTING, delay_sec=delay)
            case GaveUp(child):
                self._give_up(child)

    def _start(self, index: int) -> None:
        child, driver = self._members[index].child, self._driver

        def started() -> None:
            driver.happened(lambda now: self._started(index, now))

        def ended(outcome: Outcome) -> None:
            driver.happened(lambda now: self._ended(index, outcome, now))

        execution: Execution
        if child.node is not None:
            execution = TaskExecution(child, child.node, self._log, on_started=started, on_ended=ended)
        else:
            execution = ProcessExecution(child, driver.guard, self._log, on_started=started, on_ended=ended)
        driver.start(index, execution)

    def _started(self, index: int, now: float) -> list[Step]:
        self._members[index].running_since = now
        self._notify(index, ChildEventKind.STARTED)
        return self._plan.started(index, now)

    def _ended(self, index: int, outcome: Outcome, now: float) -> list[Step]:
        member = self._members[index]
        # Removed first: a listener of the event must not see an execution that has ended.
        pid = self._driver.executions.pop(index).pid
        member.outcome, member.running_since = outcome, None
        self._notify(index, ChildEventKind.ENDED, pid=pid)
        steps: list[Step] = []
        if isinstance(outcome.error, SystemExit | KeyboardInterrupt):
            # These end the whole process, so they are not a death to restart after.
            self._fail(outcome.error)
            steps = self._plan.stop(now)
        return steps + self._plan.ended(index, now, normal=outcome.normal)

    def _give_up(self, index: int) -> None:
        self._notify(index, ChildEventKind.GIVEN_UP)
        member = self._members[index]
        assert member.outcome is not None
        failure = SupervisorGaveUp(self.name, member.child.name, member.outcome.reason)
        failure.__cause__ = member.outcome.error
        self._fail(failure)

    def _fail(self, error: BaseException) -> None:
        """End the supervisor with an error, which `run` raises."""
        if self._driver.failure is None:
            self._driver.failure = error

    def _pid(self, index: int) -> int | None:
        execution = self._driver.executions.get(index)
        return None if execution is None else execution.pid

    def _notify(
        self, index: int, kind: ChildEventKind, *, pid: int | None = None, delay_sec: float = 0.0
    ) -> None:
        member = self._members[index]
        self._publisher.notify(
            ChildEvent(
                supervisor=self.name,
                child=member.child.name,
                kind=kind,
                stamp_ns=time.time_ns(),
                restarts=self._plan.restarts(index),
                pid=self._pid(index) or pid,
                outcome=None if kind is ChildEventKind.STARTED else member.outcome,
                delay_sec=delay_sec,
            )
        )
