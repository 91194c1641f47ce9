"""The driver of a plan: passes events to it, carries out its steps, and waits until everything has ended.

A plan is a state machine without I/O and clock. The supervisor has one and so has a launch; the timer, the
guard, the executions and the handling of errors around a plan are here.
"""

from __future__ import annotations

import asyncio
import contextvars
from collections import deque
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from actors.processes.guard import Guard

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable

    from actors.processes.execution import Execution

StepT_co = TypeVar("StepT_co", covariant=True)
StepT = TypeVar("StepT")


class Plan(Protocol[StepT_co]):
    """Decides on the next steps, without I/O and clock."""

    @property
    def finished(self) -> bool:
        """Whether everything has ended and nothing will be started any more."""
        ...

    @property
    def wake_at(self) -> float | None:
        """When to call `tick`; None: not before something else happens."""
        ...

    def tick(self, now: float, /) -> Iterable[StepT_co]:
        """Return the steps that are due."""
        ...


class Driver(Generic[StepT]):
    """Drives a plan, once. All methods are called in the event loop.

    Args:
        plan: Decides what to do.
        perform: Carries out a step.
        on_moved: Called after each transition and its steps.

    Attributes:
        executions: The executions that run, by the key given to `start`.
        guard: Ends the processes if this one dies.
        failure: The error that the owner's `run` raises; None while nothing has failed.
        finished: Set when everything has ended.
        loop: The event loop; set by `begin`.
    """

    loop: asyncio.AbstractEventLoop
    context: contextvars.Context

    def __init__(
        self,
        plan: Plan[StepT],
        perform: Callable[[StepT], None],
        on_moved: Callable[[], None] = lambda: None,
    ) -> None:
        self.executions: dict[Hashable, Execution] = {}
        self.guard = Guard()
        self.failure: BaseException | None = None
        self.finished = asyncio.Event()
        self._plan = plan
        self._perform = perform
        self._on_moved = on_moved
        self._steps: deque[StepT] = deque()
        self._performing = False
        self._timer: asyncio.TimerHandle | None = None
        self._due: float | None = None

    def begin(self, transition: Callable[[float], Iterable[StepT]]) -> None:
        """Begin with a first transition, in the running loop and a copy of the current context."""
        self.loop = asyncio.get_running_loop()
        self.context = contextvars.copy_context()
        self.happened(transition)

    def happened(self, transition: Callable[[float], Iterable[StepT]]) -> None:
        """Pass an event to the plan, and carry out its steps.

        An error of either stops all executions and becomes the `failure`.

        Args:
            transition: Passes the event: called with the current time, returns the steps.
        """
        if self.finished.is_set():
            return
        try:
            self._steps.extend(transition(self.loop.time()))
            if self._performing:  # a step has caused this event: the steps before it come first
                return
            self._performing = True
            try:
                while self._steps:
                    self._perform(self._steps.popleft())
            finally:
                self._performing = False
            self._set_timer()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 - the owner's `run` raises it
            self._break(error)
        self._on_moved()
        if not self.executions and (self._plan.finished or self.failure is not None):
            self.finished.set()

    def start(self, key: Hashable, execution: Execution) -> None:
        """Start an execution, unless something has failed."""
        if self.failure is None:
            self.executions[key] = execution
            execution.start(self.context)

    def stop_all(self) -> None:
        """Stop all executions at the same time."""
        for execution in tuple(self.executions.values()):
            execution.stop()

    def force_stop_all(self) -> None:
        """Stop all executions in the strongest way."""
        for execution in tuple(self.executions.values()):
            execution.force_stop()

    async def wait(self, on_cancel: Callable[[], None]) -> bool:
        """Wait until everything has ended and the guard is closed, also when the waiting task is cancelled.

        Args:
            on_cancel: Called at each cancellation before everything has ended.

        Returns:
            Whether the task has been cancelled.
        """
        cancelled = False
        while not self.finished.is_set():
            try:
                await self.finished.wait()
            except asyncio.CancelledError:
                cancelled = True
                on_cancel()
        closing = self.loop.create_task(self.guard.close(), name="guard")
        while not closing.done():
            try:
                await asyncio.shield(closing)
            except asyncio.CancelledError:
                cancelled = True
        return cancelled

    def _set_timer(self) -> None:
        due = self._plan.wake_at if self.failure is None else None
        if due == self._due:  # such as after each output of a process
            return
        self._due = due
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if due is not None:
            self._timer = self.loop.call_at(due, self._wake, due)

    def _wake(self, due: float) -> None:
        self._timer = self._due = None
        # A loop may call a little early; without `max` the plan would ask for the same time again.
        self.happened(lambda now: self._plan.tick(max(now, due)))

    def _break(self, error: BaseException) -> None:
        """Stop everything at once: after an error the plan may not know which executions run."""
        self.failure = self.failure or error
        self._steps.clear()
        self._set_timer()
        self.stop_all()
