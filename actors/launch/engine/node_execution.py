"""A node in the launch's own process. It starts, stops and reports its output as a process does.

Such a node needs no interpreter of its own, so that a launch of many small nodes starts fast. It shares the
event loop with the launch and its other nodes, and one that blocks delays all of them.
"""

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
"""The exit code of a program that calls `sys.exit` with a string, as in Python."""


class NodeExecution(TaskExecution):
    """One run of a node in this process. To stop it, its task is cancelled, and later cancelled again.

    The node gets the environment variables of its specification that callboard reads, and the arguments of
    its specification as its command line. Its log lines and prints are reported as its output within
    `captured_logs` and `captured_streams`.

    Args:
        spec: The node to run.
        write: Called with lines of a stream; all of them have been passed on when the node has ended.
        on_message: Called with the level and text of messages about the node.
        stop_timeout_sec: Seconds until it is cancelled again, unless the specification has a
            `sigterm_timeout_sec`. It is abandoned after `sigkill_timeout_sec` of its specification, or
            `LAST_STEP_SEC`, and also that long after its stop is forced.
        reports: Further arguments of an execution.
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
        child = Child(spec.label, node=self._run_node, stop_timeout_sec=stop_timeout_sec)
        super().__init__(
            child,
            self._run_node,
            get_logger(spec.label),
            step_timeouts_sec=spec.stop_step_timeouts_sec(),
            **reports,
        )
        self._spec = spec
        self._write = write
        self._on_message = on_message
        self._captured: CapturedOutput

    def start(self, context: Context) -> None:
        """Start it in a copy of a context."""
        colored = environment.color_wish(self._spec.environment) is True
        self._captured = CapturedOutput(
            write=self._write, on_message=self._on_message, context=context.copy(), colored=colored
        )
        super().start(context)

    async def _run(self) -> Outcome:
        # `sys.exit` in a callback would otherwise end the launch, and with it all other nodes.
        exit_ends_node.set(True)
        try:
            outcome = await super()._run()
            if isinstance(outcome.error, SystemExit):
                return outcome_of_exit(_exit_code(outcome.error))
            return outcome
        finally:
            self._captured.end()

    async def _run_node(self) -> None:
        """Run the node in its task. Context variables set here apply to the node and its tasks only."""
        spec = self._spec
        self._captured.capture()
        environment.stand_in.set(spec.environment)
        try:
            process_arguments.set(parse_ros_arguments(spec.command))
            await run_program(self._make_node)
        except Exception as error:
            # The message about the end has its text, and that is enough where the remedy is outside the node.
            if not (isinstance(error, CallboardError) and error.is_operational):
                self._log.fatal("the node has failed", exc_info=error)
            raise
        except SystemExit as error:
            if not isinstance(error.code, int | None):
                self._log.fatal(error.code)
            raise

    def _make_node(self) -> Any:
        assert self._spec.program is not None
        program: object = self._spec.program()
        level = _log_level()
        # The node's own logger: the level of the root logger applies to the launch and all its other nodes.
        if isinstance(program, Node) and level is not None:
            program.get_logger().set_level(level)
        return program

    def _report(self, severity: LoggingSeverity, text: str) -> None:
        self._on_message(Level(severity.name), f"node {text}")


def _log_level() -> LoggingSeverity | None:
    """Return the log level of the node's arguments, or else of its environment."""
    arguments, word = process_arguments.get(), environment.log_level()
    if arguments is not None and arguments.log_level is not None:
        return arguments.log_level
    return None if word is None else severity_from_name(word)


def _exit_code(error: SystemExit) -> int:
    """Return the exit code that a process would have."""
    if error.code is None:
        return 0
    # Systems keep the lowest eight bits.
    return error.code & 0xFF if isinstance(error.code, int) else FAILURE
