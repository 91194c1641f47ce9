"""Ends the tasks that still run when a program ends.

A task that ignores its cancellation is abandoned; asyncio would wait for it for ever.
"""

from __future__ import annotations

import asyncio

from actors.logging.logger import get_logger


async def end_remaining_tasks(timeout_sec: float) -> None:
    """Cancel all other tasks of this loop, wait for them this long, and log those that still run."""
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    if not tasks:
        return
    # `wait`, not `gather`: it neither raises the errors of others nor waits longer than the limit.
    _, stubborn = await asyncio.wait(tasks, timeout=timeout_sec)
    for task in stubborn:
        name = getattr(task.get_coro(), "__qualname__", task.get_name())
        get_logger("callboard").error(f"Left running: {name} ignores being cancelled")
        # Otherwise `asyncio.Runner` would cancel the task once more and wait without a limit, and a program
        # that was told to stop would not.
        asyncio._unregister_task(task)  # noqa: SLF001 - documented, for task implementations
        setattr(task, "_log_destroy_pending", False)  # noqa: B010 - untyped; already logged
