"""One execution of a child: one task, and steps to stop it, each stronger than the one before.

`stop` starts the first step. If the child has not ended within the time limit of a step, the next one
follows. After the last one the child is abandoned, so that stopping always ends. A step is carried out before
it is reported, so that a listener that fails cannot prevent it.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from actors.callbacks.functions import exit_ends_node
from actors.logging.severity import LoggingSeverity
from actors.processes.outcome import Outcome, outcome_of_error
from actors.runtime.programs import run_program

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping
    from contextvars import Context
    from typing import Any

    from actors.logging.logger import Logger
    from actors.processes.child import Child
    from actors.runtime.programs import Factory

LAST_STEP_SEC: Final = 2.0
"""Seconds from the last step until the child is abandoned."""


class Execution(ABC):
    """One execution of a child.

    Args:
        child: The child.
        log: Gets warnings and errors.
        on_started: Called when the child runs.
        on_ended: Called once, with the child's outcome.
        step_timeouts_sec: By step, time limits that differ from the child's.

    Attributes:
        pid: The process's id; None before it runs, and for children that are not processes.
    """

    def __init__(
        self,
        child: Child,
        log: Logger,
        *,
        on_started: Callable[[], None],
        on_ended: Callable[[Outcome], None],
        step_timeouts_sec: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        self.pid: int | None = None
        self._child = child
        self._log = log
        self._on_started = on_started
        self._on_ended = on_ended
        self._step_timeouts_sec = step_timeouts_sec
        self._steps = self._stop_steps()
        self._step = -1
        self._force_stopped = False
        self._timer: asyncio.TimerHandle | None = None
        self._task: asyncio.Task[Outcome] | None = None
        self._ended = False

    def start(self, context: Context) -> None:
        """Start the child in a copy of this context."""
        loop = asyncio.get_running_loop()
        self._task = loop.create_task(self._run(), name=f"child {self._child.name}", context=context.copy())
        self._task.add_done_callback(self._done)

    def stop(self) -> None:
        """Begin to stop the child. It ends within the time limits of all steps together."""
        if self._step < 0:
            self._start_step(0)

    def force_stop(self) -> None:
        """Start the last step now. The child ends within `LAST_STEP_SEC`."""
        if self._force_stopped:
            return
        self._force_stopped = True
        self.stop()
        last = len(self._steps) - 1
        if self._step < last:
            self._start_step(last)
        elif not self._ended:  # its own time limit may be longer
            self._begin_limit(last)

    @abstractmethod
    def _stop_steps(self) -> list[Callable[[], None]]:
        """Return the steps to stop the child, the strongest last."""

    @abstractmethod
    def _run(self) -> Coroutine[Any, Any, Outcome]:
        """Run the child from its start to its end."""

    def _step_timeout_sec(self, step: int) -> float:
        """Return the time limit of a step."""
        if step in self._step_timeouts_sec:
            return self._step_timeouts_sec[step]
        return LAST_STEP_SEC if step == len(self._steps) - 1 else self._child.stop_timeout_sec

    def _report(self, severity: LoggingSeverity, text: str) -> None:
        """Log a string about the child; it follows the child's name."""
        self._log.log(f"Child '{self._child.name}' {text}", severity)

    @property
    def stopping(self) -> bool:
        """Whether `stop` has been called."""
        return self._step >= 0

    def _start_step(self, step: int) -> None:
        if self._ended:
            return
        self._step = step
        # The limit first: a step that raises must not leave the child without one.
        self._begin_limit(step)
        self._steps[step]()

    def _begin_limit(self, step: int) -> None:
        """Begin the time limit of a step."""
        self._forget_timer()
        wait = LAST_STEP_SEC if self._force_stopped else self._step_timeout_sec(step)
        last = step == len(self._steps) - 1
        following = self._give_up if last else lambda: self._start_step(step + 1)
        self._timer = asyncio.get_running_loop().call_later(wait, following)

    def _give_up(self) -> None:
        assert self._task is not None
        try:
            self._report(LoggingSeverity.ERROR, "cannot be stopped; going on without it")
        finally:  # also if a handler of the log raises
            self._task.cancel()
            self._end(Outcome(normal=False, reason="could not be stopped"))

    def _done(self, task: asyncio.Task[Outcome]) -> None:
        error = asyncio.CancelledError() if task.cancelled() else task.exception()
        if error is None:
            self._end(task.result())
        else:
            self._end(outcome_of_error(error))

    def _end(self, outcome: Outcome) -> None:
        self._forget_timer()
        if self._ended:
            return
        # Set first: `on_ended` may stop other children, and with them this one.
        self._ended = True
        self._on_ended(_as_stopped(outcome) if self.stopping else outcome)

    def _forget_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


def _as_stopped(outcome: Outcome) -> Outcome:
    """Return the outcome of a child that was stopped: normal, unless it crashed meanwhile."""
    graceful = (
        outcome.normal
        or isinstance(outcome.error, asyncio.CancelledError)
        or outcome.signal_name in {"SIGINT", "SIGTERM"}
    )
    return (
        replace(outcome, normal=True, reason="stopped by its supervisor", error=None) if graceful else outcome
    )


class TaskExecution(Execution):
    """A node, supervisor or coroutine in this process."""

    def __init__(self, child: Child, program: Factory, log: Logger, **reports: Any) -> None:
        super().__init__(child, log, **reports)
        self._program = program

    def _stop_steps(self) -> list[Callable[[], None]]:
        return [self._cancel, self._cancel_again]

    async def _run(self) -> Outcome:
        self._on_started()
        try:
            await run_program(self._program)
        except SystemExit as error:
            if not exit_ends_node.get():
                raise
            return outcome_of_error(error)  # asyncio would end the whole process
        return Outcome(normal=True, reason="returned")

    def _cancel(self) -> None:
        assert self._task is not None
        self._task.cancel()

    def _cancel_again(self) -> None:
        # One loop turn later: a task gets two cancellations in the same turn as one, and the second makes a
        # supervisor force the stop.
        asyncio.get_running_loop().call_soon(self._cancel)
        self._report(LoggingSeverity.WARN, "has not stopped yet; cancelling it again")
