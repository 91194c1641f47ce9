"""A child that is a process: a script or a command, with its own child processes."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from actors.config.environment import environment_for
from actors.logging.severity import LoggingSeverity
from actors.processes.execution import LAST_STEP_SEC, Execution
from actors.processes.outcome import Outcome, outcome_of_exit

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.logging.logger import Logger
    from actors.processes.child import Child
    from actors.processes.guard import Guard
    from actors.processes.process import Process


class ProcessExecution(Execution):
    """A process and its group, under guard."""

    def __init__(self, child: Child, guard: Guard, log: Logger, **reports: Any) -> None:
        super().__init__(child, log, **reports)
        self._guard = guard
        self._process: Process | None = None

    def _stop_steps(self) -> list[Callable[[], None]]:
        return [self._interrupt, self._terminate, self._kill]

    async def _run(self) -> Outcome:
        if self.stopping:
            return Outcome(normal=True, reason="not started")
        process = self._begin()
        self._process, self.pid = process, process.pid
        try:
            self._on_started()
            return outcome_of_exit(await process.wait())
        finally:
            # If this task is torn down with its loop, the process goes first. One that cannot be stopped
            # stays with the guard; its number cannot be another's, as nobody reaps it.
            process.signal(signal.SIGKILL)
            with suppress(TimeoutError):
                async with asyncio.timeout(LAST_STEP_SEC):
                    await process.wait()
                    self._guard.forget(process.pid)

    def _begin(self) -> Process:
        child = self._child
        return self._guard.start(child.argv, cwd=child.cwd, env=environment_for(child.env))

    def _interrupt(self) -> None:
        self._send(signal.SIGINT)

    def _terminate(self) -> None:
        self._send(signal.SIGTERM)
        self._send(signal.SIGCONT)  # one that is suspended can end properly, too
        self._report(LoggingSeverity.WARN, "has not ended after SIGINT; sending SIGTERM")

    def _kill(self) -> None:
        self._send(signal.SIGKILL)
        text = "is killed" if self._force_stopped else "has not ended after SIGTERM; sending SIGKILL"
        self._report(LoggingSeverity.WARN, text)

    def _send(self, number: signal.Signals) -> None:
        if self._process is not None:
            self._process.signal(number)
