"""The background tasks of a recorder or a player, and how its work ends."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.bags.errors import BagError
from proto.aio.tasks import cancel_and_wait

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.logging.logger import Logger


class SupervisedTasks:
    """Runs tasks until the work ends: because `end` is called, or because one of them fails.

    The first error is kept. It is raised once: by `wait`, or else by `raise_error`.

    Args:
        work: What the tasks do, such as "Recording", as the log names it.
        log: Gets the traceback of an unexpected error, and the text of an error that cannot be raised.
        on_failed: Called after each error, to stop what else belongs to the work; None for nothing.
    """

    def __init__(self, work: str, log: Logger, *, on_failed: Callable[[], object] | None = None) -> None:
        self._work = work
        self._log = log
        self._on_failed = on_failed
        self._tasks: set[asyncio.Task[None]] = set()
        self._ended = asyncio.Event()
        self._error: Exception | None = None
        self._is_raised = False

    def start(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Run a coroutine as a task until it returns, is cancelled or fails."""
        task = asyncio.create_task(self._run(coroutine))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        # A task that is cancelled before its first step does not close what it was going to run.
        task.add_done_callback(lambda _: coroutine.close())
        return task

    async def _run(self, coroutine: Coroutine[Any, Any, None]) -> None:
        try:
            await coroutine
        except Exception as error:  # noqa: BLE001 - raised by `wait`, or by leaving
            self.fail(error)

    def fail(self, error: Exception) -> None:
        """Keep the error if it is the first, and end the work."""
        if self._error is None:
            self._error = error
            if not isinstance(error, BagError):  # a bug: its text alone does not say where it is
                self._log.error(f"{self._work} has failed", exc_info=error)
        self.end()
        if self._on_failed is not None:
            self._on_failed()

    def begin(self) -> None:
        """Let `wait` wait again, after an end."""
        self._ended.clear()

    def end(self) -> None:
        """Let `wait` return. Tasks go on until `cancel`."""
        self._ended.set()

    async def wait(self) -> None:
        """Wait until the work ends; raise the first error, if there is one."""
        await self._ended.wait()
        if self._error is not None:
            self._is_raised = True
            raise self._error

    async def cancel(self) -> None:
        """Cancel all tasks, and wait until they have ended."""
        for task in [*self._tasks]:
            await cancel_and_wait(task)

    def raise_error(self, *, is_failing: bool) -> None:
        """Raise the first error unless `wait` has raised it.

        Args:
            is_failing: Whether another exception is being raised, which must not be replaced: the error is
                logged then.
        """
        if self._error is None or self._is_raised:
            return
        if not is_failing:
            raise self._error
        self._log.error(str(self._error))
