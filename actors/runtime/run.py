"""`actors.run`: what a script needs around its nodes.

It reads the command line, sets up logging, runs everything on uvloop where there is one, and stops it cleanly
on SIGINT and SIGTERM. Library code does none of this.
"""

from __future__ import annotations

import asyncio
import signal
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from actors.arguments.ros_arguments import (
    InvalidRosArgumentError,
    RosArguments,
    parse_ros_arguments,
    process_arguments,
)
from actors.config import environment
from actors.logging.logger import LoggingSeverity, get_logger
from actors.logging.output import configure_logging
from actors.node.lifecycle import GRACE_SEC
from actors.runtime.programs import run_program
from actors.runtime.remaining_tasks import end_remaining_tasks
from proto.aio import process
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator, Sequence

    from actors.runtime.programs import Program

FAILURE: Final = 1
USAGE: Final = 2

PATIENT_SIGNALS: Final = 2
"""Signals that let what runs clean up."""

LAST_TASKS_SEC: Final = 8.0
"""What tasks get to end after a sys.exit in one of them, nodes that stop among them: as long as these take by
default."""

STOP_SIGNALS: Final = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name))


def run(*programs: Program, args: Sequence[str] | None = None) -> Any:
    """Run nodes and coroutine functions until they end, or SIGINT or SIGTERM comes.

    Args:
        programs: Things that return a node or a supervisor when called (Node classes, factories), coroutine
            functions, or nodes and supervisors; but a node that is made before this call has not seen the
            command line. They run side by side; when one raises, all stop.
        args: The command line without the program's name; None takes the process's. What stands behind
            `--ros-args` is for all nodes.

    Returns:
        The result of a single coroutine function; None otherwise, and when a signal ended it.

    Raises:
        SystemExit: 1 if something failed with a CallboardError, 2 if the arguments cannot be read; the error
            stands on stderr in one line. Other exceptions come through as they are.
        RuntimeError: A loop is running in this thread, as in a coroutine or a notebook.
    """
    if _loop_runs():
        raise RuntimeError(
            "actors.run() starts an event loop, and one is running already:"
            " there use `async with node:` or `await node.run()`"
        )
    try:
        with _terminate_interrupts():
            return _run(programs, sys.argv[1:] if args is None else list(args))
    except KeyboardInterrupt:
        return None


def _loop_runs() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


@contextmanager
def _terminate_interrupts() -> Generator[None]:
    """Let SIGTERM raise KeyboardInterrupt, as SIGINT does, before the loop listens to both and after it.

    Both are as before in the end: uvloop leaves a closed loop's handler behind.
    """
    if not _in_main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _run(programs: Sequence[Program], argv: list[str]) -> Any:
    try:
        arguments = parse_ros_arguments(argv)
        set_up_logging(arguments)
    except (InvalidRosArgumentError, CallboardError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - there is no logging yet
        raise SystemExit(USAGE) from None
    token = process_arguments.set(arguments)
    process.configure_process()
    try:
        return run_until_signal(lambda: _run_all(programs))
    except CallboardError as error:
        get_logger("callboard").fatal(str(error))
        raise SystemExit(FAILURE) from None
    finally:
        process_arguments.reset(token)


def set_up_logging(arguments: RosArguments) -> None:
    """Send the process's log to stderr, as the arguments and the environment want it."""
    level = arguments.log_level or environment.log_level() or LoggingSeverity.INFO
    configure_logging(level if arguments.stdout_logs else LoggingSeverity.FATAL)
    for name, severity in arguments.logger_levels:
        get_logger(name).set_level(severity)


def run_until_signal(main: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
    """Run a coroutine on a new loop (uvloop's, where there is one); SIGINT and SIGTERM cancel it.

    A second signal cancels it again, which hurries a node that stops; a third one waits for it no longer.

    Returns:
        Its result; None if a signal ended it.
    """
    signals = _Signals()

    async def guarded() -> Any:
        signals.listen()
        return await main()

    try:
        with asyncio.Runner(loop_factory=process.new_event_loop) as runner:
            try:
                return runner.run(guarded())
            finally:
                patience_sec = signals.end()
                runner.get_loop().run_until_complete(end_remaining_tasks(patience_sec))
    except KeyboardInterrupt:
        return None
    except asyncio.CancelledError:
        if signals.count:
            return None
        raise
    except BaseExceptionGroup as group:
        others = group.subgroup(lambda error: not isinstance(error, asyncio.CancelledError))
        if signals.count and others is None:
            return None
        raise


class _Signals:
    """What SIGINT and SIGTERM do to one run: each asks more firmly.

    Attributes:
        count: How many came.
    """

    def __init__(self) -> None:
        self.count = 0
        self._ending = False
        self._task: asyncio.Task[Any] | None = None

    def listen(self) -> None:
        """Let them cancel the current task, wherever signals can be listened to."""
        self._task = asyncio.current_task()
        for number in STOP_SIGNALS if _in_main_thread() else ():
            _on_signal(asyncio.get_running_loop(), number, self._came)

    def _came(self) -> None:
        self.count += 1
        if self.count <= PATIENT_SIGNALS:
            assert self._task is not None
            self._task.cancel()
        elif not self._ending:
            raise KeyboardInterrupt

    def end(self) -> float:
        """The run is over and signals change nothing; return the seconds that tasks which are left get."""
        self._ending = True
        exited = self._task is not None and not self._task.done()
        return LAST_TASKS_SEC if exited and self.count <= PATIENT_SIGNALS else GRACE_SEC


def _on_signal(loop: asyncio.AbstractEventLoop, number: int, stop: Callable[[], None]) -> None:
    try:
        loop.add_signal_handler(number, stop)
    except NotImplementedError:  # Windows
        signal.signal(number, lambda _number, _frame: loop.call_soon_threadsafe(stop))


async def _run_all(programs: Sequence[Program]) -> Any:
    if len(programs) == 1:
        return await run_program(programs[0])
    loop = asyncio.get_running_loop()
    left = {loop.create_task(run_program(program)) for program in programs}
    failure: BaseException | None = None
    while left:
        to_cancel: set[asyncio.Task[Any]] = set()
        try:
            ended, left = await asyncio.wait(left, return_when=asyncio.FIRST_EXCEPTION)
        except asyncio.CancelledError as cancelled:
            failure, to_cancel = failure or cancelled, left  # every time: the second hurries the programs
        else:
            reason = _first_failure(ended)
            if failure is None and reason is not None:
                failure, to_cancel = reason, left
        for task in to_cancel:
            task.cancel()
    if failure is not None:
        raise failure
    return None


def _first_failure(tasks: set[asyncio.Task[Any]]) -> BaseException | None:
    """Return what one of some ended tasks has failed with: one script, one reason."""
    for task in tasks:
        error = asyncio.CancelledError() if task.cancelled() else task.exception()
        if error is not None:
            return error
    return None
