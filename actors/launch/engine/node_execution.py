"""A node in the launch's own process: started, stopped and heard like one that has a process of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.arguments.ros_arguments import parse_ros_arguments, process_arguments
from actors.callbacks.functions import exit_ends_node
from actors.config import environment
from actors.launch.engine.captured_output import CapturedOutput
from actors.launch.planning.events import Level
from actors.logging.logger import get_logger
from actors.logging.severity import LoggingSeverity, severity_from_name
from actors.node.node import Node
from actors.processes.child import Child
from actors.processes.execution import TaskExecution
from actors.processes.outcome import Outcome, outcome_of_exit
from actors.runtime.programs import run_program
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextvars import Context

    from actors.launch.planning.events import Stream
    from actors.launch.planning.process_spec import ProcessSpec

FAILURE = 1
"""The exit code of a program that leaves with a text."""


class NodeExecution(TaskExecution):
    """One run of a node in this process. It is cancelled to stop it, and cancelled again.

    It has the environment of its specification, as far as callboard reads it, and takes the arguments there
    as a script takes its command line. What it logs and prints is reported as its output, if there are
    `captured_logs` and `captured_streams`. While its code runs, nothing else in the process runs.

    Args:
        spec: What to run.
        write: Takes its lines; at its end all of them have come.
        on_message: Called with the level and text of each message about it.
        stop_timeout_sec: What it may take to stop before it is cancelled again, unless the specification's
            `sigterm_timeout_sec` says otherwise. Then it gets `sigkill_timeout_sec`, or else `LAST_STEP_SEC`,
            before it is given up; when its stop is forced it gets the latter.
        reports: As an execution's.
    """

    def __init__(
        self,
        spec: ProcessSpec,
        *,
        write: Callable[[Stream, Sequence[bytes]], None],
        on_message: Callable[[Level, str], None],
        stop_timeout_sec: float,
        **reports: Any,
    ) -> None:
        child = Child(spec.label, node=self._live, stop_timeout_sec=stop_timeout_sec)
        super().__init__(
            child,
            self._live,
            get_logger(spec.label),
            step_timeouts_sec=spec.stop_step_timeouts_sec(),
            **reports,
        )
        self._spec = spec
        self._write = write
        self._on_message = on_message
        self._captured: CapturedOutput

    def start(self, context: Context) -> None:
        """Begin, in a copy of this context."""
        colored = environment.color_wish(self._spec.environment) is True
        self._captured = CapturedOutput(
            write=self._write, on_message=self._on_message, context=context.copy(), colored=colored
        )
        super().start(context)

    async def _run(self) -> Outcome:
        exit_ends_node.set(True)
        try:
            outcome = await super()._run()
            if isinstance(outcome.error, SystemExit):
                return outcome_of_exit(_exit_code(outcome.error))
            return outcome
        finally:
            self._captured.end()

    async def _live(self) -> None:
        """Be the node. What is set here holds for it and what it starts, and not for the launch."""
        spec = self._spec
        self._captured.capture()
        environment.stand_in.set(spec.environment)
        try:
            process_arguments.set(parse_ros_arguments(spec.command))
            await run_program(self._made)
        except CallboardError:
            raise  # its text says enough
        except Exception as error:
            self._log.fatal("the node has failed", exc_info=error)
            raise
        except SystemExit as error:
            if not isinstance(error.code, int | None):
                self._log.fatal(error.code)
            raise

    def _made(self) -> Any:
        assert self._spec.program is not None
        made: object = self._spec.program()
        level = _log_level()
        if isinstance(made, Node) and level is not None:
            made.get_logger().set_level(level)
        return made

    def _report(self, severity: LoggingSeverity, text: str) -> None:
        self._on_message(Level(severity.name), f"node {text}")


def _log_level() -> LoggingSeverity | None:
    """Return the level that its arguments or its environment want for the node."""
    arguments, word = process_arguments.get(), environment.log_level()
    if arguments is not None and arguments.log_level is not None:
        return arguments.log_level
    return None if word is None else severity_from_name(word)


def _exit_code(error: SystemExit) -> int:
    """Return the exit code that a process would have."""
    if error.code is None:
        return 0
    return error.code & 0xFF if isinstance(error.code, int) else FAILURE
