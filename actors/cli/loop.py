"""Run a command's coroutine; a signal cancels it and is then raised as `Interrupted`."""

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
"""Time for cancelled tasks to end. A task that ignores its cancellation is named and left running."""
LAST_COMMAND_SEC: Final = 60.0
"""Time for the command's own coroutine to end, after a `sys.exit` in another task."""

_exits: Final[list[SystemExit]] = []


def run_async(
    main: Callable[[], Coroutine[Any, Any, T]],
    *,
    loop_factory: Callable[[], asyncio.AbstractEventLoop] | None = None,
) -> T:
    """Run a coroutine on an event loop of its own.

    Args:
        main: Returns the coroutine.
        loop_factory: Makes the loop; None for asyncio's, which is imported fastest.

    Raises:
        Interrupted: SIGINT or SIGTERM arrived; `main` was cancelled and has cleaned up.
    """
    command = _Command()
    _exits.clear()
    raise_if_signalled()
    try:
        with asyncio.Runner(loop_factory=loop_factory) as runner:
            try:
                return runner.run(command.run(main))
            except SystemExit as error:  # from a callback or another task: asyncio leaves the loop
                _exits.append(error)
                runner.get_loop().run_until_complete(command.end())
                raise
            finally:
                runner.get_loop().run_until_complete(_end_others())
    except asyncio.CancelledError:
        if not command.received:
            raise
        raise Interrupted(command.received[0]) from None
    finally:
        record_signals()  # the loop has restored the system's handlers


class _Command:
    """The task of a command, which a signal cancels.

    Attributes:
        received: The signals that arrived.
    """

    def __init__(self) -> None:
        self.received: list[int] = []
        self._task: asyncio.Task[Any] | None = None

    async def run(self, main: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Run the command in the current task."""
        self._task = asyncio.current_task()
        if threading.current_thread() is threading.main_thread():
            self._handle_signals()
            earlier = recorded_signal()
            if earlier is not None:
                self._stop(earlier)
        return await main()

    async def end(self) -> None:
        """Cancel the command and wait for it: it ends what else runs."""
        if self._task is not None and not self._task.done():
            self._task.cancel()
            await asyncio.wait({self._task}, timeout=LAST_COMMAND_SEC)

    def _stop(self, number: int) -> None:
        assert self._task is not None
        self.received.append(number)
        self._task.cancel()

    def _handle_signals(self) -> None:
        loop = asyncio.get_running_loop()
        for number in STOP_SIGNALS:
            try:
                loop.add_signal_handler(number, self._stop, int(number))
            except NotImplementedError:  # Windows: the handlers of `record_signals` stay
                return


def exit_asked_for() -> int | None:
    """Return the exit code of a `sys.exit` in another task than the command's; None if there was none."""
    if not _exits:
        return None
    code = _exits[0].code
    return 1 if isinstance(code, str) else int(code or 0) & 0xFF


async def _end_others() -> None:
    if len(asyncio.all_tasks()) > 1:
        from actors.runtime.remaining_tasks import end_remaining_tasks  # noqa: PLC0415 - seldom needed

        await end_remaining_tasks(LAST_TASKS_SEC)
