"""Supervision of background tasks: log a failure with its traceback and start the task again."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

RESTART_PAUSE_SEC: Final = 1.0
"""Between a failure and the restart, so that a task that fails at once does not fill the log."""


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
