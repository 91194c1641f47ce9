"""Background tasks: supervise them (log a failure with its traceback and start again), and end them."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

RESTART_PAUSE_SEC: Final = 1.0
"""Pause between a failure and the restart, so that a task that fails at once does not fill the log."""


async def keep_running(
    name: str, run: Callable[[], Awaitable[None]], *, pause_sec: float = RESTART_PAUSE_SEC
) -> None:
    """Run a background job until it returns or is cancelled, and restart it whenever it raises.

    Args:
        name: The name of the job in the log.
        run: Starts the job; called again after each failure.
        pause_sec: Seconds between a failure and the restart.
    """
    while True:
        try:
            return await run()
        except Exception:  # a bug: log it, and keep the job's function alive
            text = "%s failed; it starts again in %g s"
            logging.getLogger("callboard").exception(text, name, pause_sec)
        await asyncio.sleep(pause_sec)


async def cancel_and_wait(task: asyncio.Task[None]) -> None:
    """Cancel a task and wait until it has ended, also when the wait is cancelled.

    Args:
        task: The task. It is cancelled again at each cancellation of the wait.

    Raises:
        CancelledError: The wait was cancelled; the task has ended nevertheless.
    """
    cancelled: asyncio.CancelledError | None = None
    task.cancel()
    while not task.done():
        try:
            await asyncio.wait({task})
        except asyncio.CancelledError as error:
            cancelled = error
            task.cancel()
    if cancelled is not None:
        raise cancelled
