"""Runs a command's coroutine; a signal cancels it and is then reported as `Interrupted`."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.cli.interrupts import (
    STOP_SIGNALS,
    Interrupted,
    raise_if_signalled,
    record_signals,
    recorded_signal,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

T = TypeVar("T")

LAST_TASKS_SEC: Final = 1.0
"""What tasks that still run get to end. What ignores being cancelled is left running, and named."""
LAST_COMMAND_SEC: Final = 60.0
"""What the command's own coroutine gets, after a `sys.exit` beside it."""

_exits: Final[list[SystemExit]] = []


def run_async(
    main: Callable[[], Coroutine[Any, Any, T]],
    *,
    loop_factory: Callable[[], asyncio.AbstractEventLoop] | None = None,
) -> T:
    """Run `main` on a loop of its own: asyncio's, which is there soonest, or one that `loop_factory` returns.

    Raises:
        Interrupted: SIGINT or SIGTERM came; `main` has been cancelled and has cleaned up.
    """
    received: list[int] = []
    tasks: list[asyncio.Task[Any]] = []
    _exits.clear()

    async def guarded() -> T:
        task = asyncio.current_task()
        assert task is not None
        tasks.append(task)

        def stop(number: int) -> None:
            received.append(number)
            task.cancel()

        if threading.current_thread() is threading.main_thread():
            _listen(asyncio.get_running_loop(), stop)
            earlier = recorded_signal()
            if earlier is not None:
                stop(earlier)
        return await main()

    raise_if_signalled()
    try:
        with asyncio.Runner(loop_factory=loop_factory) as runner:
            try:
                return runner.run(guarded())
            except SystemExit as error:  # out of a callback or another task: asyncio leaves the loop for it
                _exits.append(error)
                runner.get_loop().run_until_complete(_end(tasks))
                raise
            finally:
                runner.get_loop().run_until_complete(_end_others())
    except asyncio.CancelledError:
        if not received:
            raise
        raise Interrupted(received[0]) from None
    finally:
        record_signals()  # the loop has put the system's own handlers in place


def exit_asked_for() -> int | None:
    """Return the exit code that a `sys.exit` beside the command asks for; None: there was none."""
    if not _exits:
        return None
    code = _exits[0].code
    return 1 if isinstance(code, str) else int(code or 0) & 0xFF


async def _end(tasks: list[asyncio.Task[Any]]) -> None:
    """Let the command clean up first: what else runs is its own to end."""
    left = [task for task in tasks if not task.done()]
    for task in left:
        task.cancel()
    if left:
        await asyncio.wait(left, timeout=LAST_COMMAND_SEC)


async def _end_others() -> None:
    if len(asyncio.all_tasks()) > 1:
        from actors.runtime.remaining_tasks import end_remaining_tasks  # noqa: PLC0415 - seldom needed

        await end_remaining_tasks(LAST_TASKS_SEC)


def _listen(loop: asyncio.AbstractEventLoop, stop: Callable[[int], None]) -> None:
    for number in STOP_SIGNALS:
        try:
            loop.add_signal_handler(number, stop, int(number))
        except NotImplementedError:  # Windows: the handler that `main` has installed stays
            return
