"""Supervision of background tasks: a task that fails is logged with its traceback and started again."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

RESTART_PAUSE_SEC: Final = 1.0
"""Between a failure and the restart: a task that fails at once must not fill the log."""


async def keep_running(
    name: str, run: Callable[[], Awaitable[None]], *, pause_sec: float = RESTART_PAUSE_SEC
) -> None:
    """Run a background job until it returns or is cancelled, and start it again whenever it raises.

    Args:
        name: What the job is, for the log.
        run: Starts the job; called again after each failure.
        pause_sec: Seconds between a failure and the restart.
    """
    while True:
        try:
            return await run()
        except Exception:  # every failure is a bug: it is logged, and must not end what the job is for
            text = "%s failed; it starts again in %g s"
            logging.getLogger("callboard").exception(text, name, pause_sec)
        await asyncio.sleep(pause_sec)
