"""The runner: carries a plan out, from the first start to the last end.

It ends when nothing is left to run or to come. What happens is a callback of a process or a timer; only the
caller of `run` waits.
"""

from __future__ import annotations

import asyncio
import contextvars
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.callbacks import error_text
from actors.launch.process import LaunchedProcess
from actors.launch.steps import End, Say, Start
from actors.logger import get_logger
from actors.supervision.guard import Guard

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.steps import ProcessSpec, Step
    from actors.supervision.outcome import Outcome

STOP_TIMEOUT_SEC: Final = 5.0
"""As in ROS 2, before each stronger signal."""


class Runner:
    """Runs the steps of a plan, once.

    Args:
        steps: What to do.
        write: Takes the lines of all processes, labelled; it must not wait.
        stop_timeout_sec: What a process may take after SIGINT before it gets SIGTERM, and after that before
            it gets SIGKILL. All are stopped at the same time.
    """

    def __init__(
        self,
        steps: Sequence[Step],
        write: Callable[[bytes], None],
        *,
        stop_timeout_sec: float = STOP_TIMEOUT_SEC,
    ) -> None:
        self._steps = steps
        self._write = write
        self._stop_timeout_sec = stop_timeout_sec
        self._log = get_logger("launch")
        self._guard = Guard()
        self._running: dict[str, LaunchedProcess] = {}
        self._timers: set[asyncio.TimerHandle] = set()
        self._respawns: dict[str, int] = {}
        self._stopping = False
        self._required_died = False
        self._over = asyncio.Event()
        self._context: contextvars.Context

    async def run(self) -> bool:
        """Run to the end; return False if a required process has died. Cancelling it is `stop`.

        Raises:
            CancelledError: It was cancelled; all processes have ended all the same.
        """
        self._context = contextvars.copy_context()
        for step in self._steps:
            if step.after_sec > 0:
                self._later(step.after_sec, partial(self._take, step))
            else:
                self._take(step)
        self._look()
        try:
            await self._wait()
        finally:
            await self._guard.close()
        return not self._required_died

    def stop(self, reason: str) -> None:
        """Stop all processes; a second time, kill them. `run` returns when they have ended."""
        if self._stopping:
            for process in tuple(self._running.values()):
                process.hurry()
            return
        self._stopping = True
        if self._running:
            self._log.info(f"stopping: {reason}")
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        for process in tuple(self._running.values()):
            process.stop()
        self._look()

    async def _wait(self) -> None:
        cancelled: asyncio.CancelledError | None = None
        while not self._over.is_set():
            try:
                await self._over.wait()
            except asyncio.CancelledError as error:
                cancelled = error
                self.stop("interrupted")
        if cancelled is not None:
            raise cancelled

    def _take(self, step: Step) -> None:
        if self._stopping:
            return
        if isinstance(step, Start):
            self._start(step.process)
        elif isinstance(step, Say):
            self._log.info(step.text)
        elif isinstance(step, End):
            self.stop(step.reason)

    def _start(self, spec: ProcessSpec) -> None:
        log = get_logger(spec.label)

        def started() -> None:
            log.info(f"process started with pid [{process.pid}]")

        process = LaunchedProcess(
            spec,
            self._guard,
            log,
            write=self._write,
            stop_timeout_sec=self._stop_timeout_sec,
            on_started=started,
            on_ended=partial(self._ended, spec),
        )
        self._running[spec.label] = process
        process.start(self._context)

    def _ended(self, spec: ProcessSpec, outcome: Outcome) -> None:
        process = self._running.pop(spec.label)
        log = get_logger(spec.label)
        if outcome.error is not None:
            log.error(f"process could not be run: {error_text(outcome.error)}")
        elif process.pid is not None:
            if outcome.normal:
                log.info(f"process has finished cleanly [pid {process.pid}]")
            else:
                log.error(f"process has died [pid {process.pid}, {outcome.reason}, cmd '{spec.shown}']")
        if not self._stopping and not self._respawn(spec) and spec.required:
            self._required_died = not outcome.normal
            self.stop(f"{spec.label} is required and has ended")
        self._look()

    def _respawn(self, spec: ProcessSpec) -> bool:
        """Start it again after a while, if that is to be; return whether it is."""
        done = self._respawns.get(spec.label, 0)
        if not spec.respawn or done == spec.respawn_max_retries:
            return False
        self._respawns[spec.label] = done + 1
        get_logger(spec.label).info(f"process starts again in {spec.respawn_delay_sec:g} s")
        self._later(spec.respawn_delay_sec, lambda: self._start(spec))
        return True

    def _later(self, delay_sec: float, act: Callable[[], None]) -> None:
        def due() -> None:
            self._timers.discard(timer)
            act()
            self._look()

        timer = asyncio.get_running_loop().call_later(delay_sec, due)
        self._timers.add(timer)

    def _look(self) -> None:
        """Is anything left?"""
        if not self._running and not self._timers:
            self._over.set()
