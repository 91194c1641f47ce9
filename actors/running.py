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

from actors import environment
from actors.arguments import InvalidRosArgumentError, RosArguments, parse_ros_arguments
from actors.log_output import configure_logging
from actors.logger import LoggingSeverity, get_logger
from actors.node import process_arguments
from actors.programs import run_program
from proto import process
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator, Sequence

    from actors.programs import Program

FAILURE: Final = 1
USAGE: Final = 2

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
    """
    try:
        with _terminate_interrupts():
            return _run(programs, sys.argv[1:] if args is None else list(args))
    except KeyboardInterrupt:
        return None


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
    process.settle()
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

    Returns:
        Its result; None if a signal ended it.
    """
    stopped = False

    async def guarded() -> Any:
        nonlocal stopped
        task = asyncio.current_task()
        assert task is not None
        loop = asyncio.get_running_loop()

        def stop() -> None:
            nonlocal stopped
            stopped = True
            task.cancel()

        for number in STOP_SIGNALS if _in_main_thread() else ():
            _on_signal(loop, number, stop)
        return await main()

    try:
        with asyncio.Runner(loop_factory=process.new_event_loop) as runner:
            return runner.run(guarded())
    except KeyboardInterrupt:
        return None
    except asyncio.CancelledError:
        if stopped:
            return None
        raise
    except BaseExceptionGroup as group:
        if stopped and group.subgroup(lambda error: not isinstance(error, asyncio.CancelledError)) is None:
            return None
        raise


def _on_signal(loop: asyncio.AbstractEventLoop, number: int, stop: Callable[[], None]) -> None:
    try:
        loop.add_signal_handler(number, stop)
    except NotImplementedError:  # Windows
        signal.signal(number, lambda _number, _frame: loop.call_soon_threadsafe(stop))


async def _run_all(programs: Sequence[Program]) -> Any:
    if len(programs) == 1:
        return await run_program(programs[0])
    try:
        async with asyncio.TaskGroup() as group:
            for program in programs:
                group.create_task(run_program(program))
    except BaseExceptionGroup as failures:
        # One script, one reason: the first failure speaks for the group it brought down.
        raise failures.exceptions[0] from None
    return None
