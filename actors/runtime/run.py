"""`actors.run`: runs a script's nodes.

It parses the command line, sets up logging, runs the nodes on uvloop if it is installed, and stops them
cleanly on SIGINT and SIGTERM. Library code does none of this.
"""

from __future__ import annotations

import asyncio
import signal
import sys
import threading
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final

from actors.arguments.ros_arguments import (
    InvalidRosArgumentError,
    RosArguments,
    parse_ros_arguments,
    process_arguments,
)
from actors.config import environment
from actors.interfaces.keyword_hint import add_keyword_hint
from actors.logging.logger import get_logger
from actors.logging.output import configure_logging
from actors.logging.severity import LoggingSeverity
from actors.node.node_runner import GRACE_SEC
from actors.runtime.loop_watch import STOP_SIGNALS, watch_loop
from actors.runtime.programs import require_program, run_program
from actors.runtime.remaining_tasks import end_remaining_tasks
from proto.aio import process
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator, Sequence
    from types import FrameType, TracebackType

    from actors.runtime.programs import Program

FAILURE: Final = 1
USAGE: Final = 2

CANCELLING_SIGNALS: Final = 2
"""Number of signals that cancel the program, which may still clean up; a later one interrupts it."""

LAST_TASKS_SEC: Final = 8.0
"""Time for tasks to end after a sys.exit in one of them: the default time that a node needs to stop."""

_RUNTIME: Final = ("actors.", "asyncio.", "uvloop.")
"""The modules before a program in a traceback."""


def run(*programs: Program, args: Sequence[str] | None = None) -> Any:
    """Run nodes and coroutine functions until they end, or SIGINT or SIGTERM comes.

    Args:
        programs: Node classes, factories of nodes or supervisors, coroutine functions, or nodes and
            supervisors; a node made before this call does not use the command line. They run concurrently;
            when one raises, all stop.
        args: The command line without the program's name; None: that of the process. Arguments after
            `--ros-args` apply to all nodes.

    Returns:
        The result of a single coroutine function; None otherwise, and when a signal ended it.

    Raises:
        SystemExit: 1 if a program failed with a CallboardError, which is logged: with its traceback, or in
            one line if the remedy is outside the program (`CallboardError.is_operational`). 2 if the
            arguments are invalid; one line on stderr says why. Other exceptions propagate.
        TypeError: A program can be neither run nor called, such as the coroutine `main()` instead of `main`.
        RuntimeError: A loop is running in this thread, as in a coroutine or a notebook.
    """
    if _loop_runs():
        # asyncio would raise as well, but from its own code and without the remedy.
        raise RuntimeError(
            "actors.run() starts an event loop, but one is already running:"
            " use `async with node:` or `await node.run()` instead"
        )
    for program in programs:
        require_program(program)
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
    """Make SIGTERM raise KeyboardInterrupt, as SIGINT does, before and after the loop handles both.

    Restore both handlers at the end: uvloop leaves those of a closed loop.
    """
    if not _in_main_thread():
        yield
        return
    previous = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in previous.items():
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
    # A context variable, not a global: nodes made inside see these arguments, and after `run` a notebook or
    # a test that calls it again starts without them.
    token = process_arguments.set(arguments)
    # After the imports and before the first node: what exists now is never collected, and is skipped from
    # here on.
    process.configure_process()
    try:
        return run_until_signal(lambda: _run_all(programs))
    except CallboardError as error:
        error.__traceback__ = _from_program(error.__traceback__)
        get_logger("callboard").fatal(str(error), exc_info=None if error.is_operational else error)
        raise SystemExit(FAILURE) from None
    except Exception as error:
        add_keyword_hint(error)
        raise
    finally:
        process_arguments.reset(token)


def _from_program(traceback: TracebackType | None) -> TracebackType | None:
    """Return a traceback without the steps before the program's first one; all of it if there is none."""
    first = traceback
    while first is not None and first.tb_frame.f_globals.get("__name__", "").startswith(_RUNTIME):
        first = first.tb_next
    return first or traceback


def set_up_logging(arguments: RosArguments, **output: Any) -> None:
    """Send the process's log to stderr, with the levels of the arguments and the environment.

    Args:
        arguments: The arguments.
        output: Further options of `configure_logging`.
    """
    level = arguments.log_level or environment.log_level() or LoggingSeverity.INFO
    configure_logging(level, only_fatal=not arguments.stdout_logs, **output)
    for name, severity in arguments.logger_levels:
        get_logger(name).set_level(severity)


def run_until_signal(main: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
    """Run a coroutine on a new loop (uvloop's, if installed); SIGINT and SIGTERM cancel it.

    A second signal cancels it again, which shortens a node's stop; a third one ends the wait for it. If a
    callback blocks the loop, the second one interrupts the callback (`loop_watch.py`).

    Returns:
        Its result; None if a signal ended it.
    """
    signals = _Signals()
    # Before the loop exists, so that there is no moment at which a signal is lost or raises inside the
    # loop's start.
    signals.record()

    async def guarded() -> Any:
        signals.listen()
        return await main()

    try:
        with asyncio.Runner(loop_factory=process.new_event_loop) as runner:
            try:
                return runner.run(guarded())
            finally:
                # From here on further signals no longer interrupt: what is left is bounded by
                # `timeout_sec`, and an interrupt would cut short what tasks clean up.
                timeout_sec = signals.end()
                try:
                    runner.get_loop().run_until_complete(end_remaining_tasks(timeout_sec))
                finally:
                    signals.watching.close()
    except KeyboardInterrupt:
        return None
    except asyncio.CancelledError:
        # The cancellation that a signal caused is a clean end. One that came from elsewhere is the caller's
        # to see.
        if signals.count:
            return None
        raise
    except BaseExceptionGroup as group:
        # A program with a TaskGroup may report its cancellation as a group.
        others = group.subgroup(lambda error: not isinstance(error, asyncio.CancelledError))
        if signals.count and others is None:
            return None
        raise


class _Signals:
    """Handles SIGINT and SIGTERM: the first two cancel the task, later ones interrupt it.

    Attributes:
        count: Signals received.
        watching: Ends the watch over the loop.
    """

    def __init__(self) -> None:
        self.count = 0
        self.watching = ExitStack()
        self._ending = False
        self._task: asyncio.Task[Any] | None = None

    def record(self) -> None:
        """Count signals until `listen`.

        A KeyboardInterrupt between a loop's first steps would leave it half started: uvloop then takes itself
        for running, and cannot be closed.
        """
        for number in STOP_SIGNALS if _in_main_thread() else ():
            signal.signal(number, self._on_early_signal)

    def listen(self) -> None:
        """Handle signals by cancelling the current task, where handlers can be installed."""
        self._task = asyncio.current_task()
        for number in STOP_SIGNALS if _in_main_thread() else ():
            process.add_signal_handler(asyncio.get_running_loop(), number, self._on_signal)
        self.watching.enter_context(watch_loop())
        # A signal arrived between `record` and now. Only now is there a task to cancel.
        if self.count:
            assert self._task is not None
            self._task.cancel()

    def _on_early_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.count += 1

    def _on_signal(self) -> None:
        self.count += 1
        if self.count <= CANCELLING_SIGNALS:
            assert self._task is not None
            self._task.cancel()
        elif not self._ending:
            raise KeyboardInterrupt

    def end(self) -> float:
        """Ignore later signals; return the seconds that remaining tasks have to end."""
        self._ending = True
        # A sys.exit in one task leaves the main task running, and its node with it: that node needs the
        # time to stop that it would have had otherwise. After two signals the user has asked twice not to
        # wait.
        exited = self._task is not None and not self._task.done()
        return LAST_TASKS_SEC if exited and self.count <= CANCELLING_SIGNALS else GRACE_SEC


async def _run_all(programs: Sequence[Program]) -> Any:
    # Run in this very task, so that a signal cancels the program itself and tracebacks stay short.
    if len(programs) == 1:
        return await run_program(programs[0])
    loop = asyncio.get_running_loop()
    running = {loop.create_task(run_program(program)) for program in programs}
    failure: BaseException | None = None
    while running:
        to_cancel: set[asyncio.Task[Any]] = set()
        try:
            # Not a TaskGroup: it would raise a group, where users expect the error of the program that
            # failed, and it does not hand a second cancellation on to tasks that are ending already.
            ended, running = await asyncio.wait(running, return_when=asyncio.FIRST_EXCEPTION)
        except asyncio.CancelledError as cancelled:
            failure, to_cancel = failure or cancelled, running  # each time: a second one shortens their stop
        else:
            reason = _first_failure(ended)
            if failure is None and reason is not None:
                failure, to_cancel = reason, running
        for task in to_cancel:
            task.cancel()
    if failure is not None:
        raise failure
    return None


def _first_failure(tasks: set[asyncio.Task[Any]]) -> BaseException | None:
    """Return the error of one of the ended tasks, or None."""
    for task in tasks:
        error = asyncio.CancelledError() if task.cancelled() else task.exception()
        if error is not None:
            return error
    return None
