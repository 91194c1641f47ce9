"""A process of the launch. A guard kills it if the launch is killed; its output is read line by line."""

from __future__ import annotations

import asyncio
import os
from contextlib import AsyncExitStack, suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.launch.engine.lines import LineSplitter
from actors.launch.engine.preflight import preflight
from actors.launch.planning.events import Level, Stream
from actors.logging.logger import get_logger
from actors.processes.child import Child
from actors.processes.process_execution import ProcessExecution
from actors.processes.pseudo_terminal import CAN_EMULATE, open_terminal

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.planning.process_spec import ProcessSpec
    from actors.logging.severity import LoggingSeverity
    from actors.processes.guard import Guard
    from actors.processes.outcome import Outcome
    from actors.processes.process import Process

REST_TIMEOUT_SEC: Final = 1.0
"""How long its pipe or terminal is read after its end. Only processes outside its group keep it open."""


class LaunchedProcess(ProcessExecution):
    """One run of a process. It is stopped as a supervisor's child is: SIGINT, SIGTERM, SIGKILL.

    Args:
        spec: What to run.
        guard: Kills it if this process is killed.
        split: Whether stdout and stderr are separate streams. Otherwise one stream keeps the order of lines.
        write: Called with lines of a stream; all of them have been passed on when the process has ended.
        on_message: Called with the level and text of messages about the process.
        stop_timeout_sec: The time for each step of stopping it, unless the specification has another.
        reports: Further arguments of an execution.
    """

    def __init__(
        self,
        spec: ProcessSpec,
        guard: Guard,
        *,
        split: bool,
        write: Callable[[Stream, Sequence[bytes]], None],
        on_message: Callable[[Level, str], None],
        stop_timeout_sec: float,
        **reports: Any,
    ) -> None:
        child = Child(spec.label, command=spec.command, cwd=spec.cwd, stop_timeout_sec=stop_timeout_sec)
        super().__init__(
            child, guard, get_logger(spec.label), step_timeouts_sec=spec.stop_step_timeouts_sec(), **reports
        )
        self._spec = spec
        self._write = write
        self._on_message = on_message
        self._streams = (Stream.STDOUT, Stream.STDERR) if split else (Stream.OUTPUT,)
        self._pipes: list[int] = []

    async def _run(self) -> Outcome:
        if not self.stopping and (problem := preflight(self._spec)) is not None:
            return problem
        async with AsyncExitStack() as stack:
            stack.callback(self._close_pipes)
            # Before the start: what a process writes at once is read.
            readers = [await self._open(stream, stack) for stream in self._streams]
            outcome = await super()._run()
            self._close_pipes()  # they are open if it was stopped before it was started
            # Lines that are in the pipe must be reported before the end. A daemon that has left the process
            # group may hold the pipe open for ever, so this has a limit.
            with suppress(TimeoutError):
                async with asyncio.timeout(REST_TIMEOUT_SEC):
                    for reader in readers:
                        await reader.ended.wait()
            return outcome

    async def _open(self, stream: Stream, stack: AsyncExitStack) -> _Reader:
        """Open a pipe or a pseudo-terminal, and begin to read it."""
        reading, writing = open_terminal() if self._spec.emulate_tty and CAN_EMULATE else os.pipe()
        self._pipes.append(writing)
        source = os.fdopen(reading, "rb", buffering=0)  # the transport closes it
        reader = _Reader(partial(self._write, stream))
        try:
            transport, _ = await asyncio.get_running_loop().connect_read_pipe(lambda: reader, source)
        except BaseException:
            source.close()
            raise
        stack.callback(reader.end)
        stack.callback(transport.close)
        return reader

    def _report(self, severity: LoggingSeverity, text: str) -> None:
        self._on_message(Level(severity.name), f"process {text}")

    def _begin(self) -> Process:
        spec = self._spec
        output, errors = self._pipes[0], self._pipes[-1]  # the same one if the streams are not split
        try:
            return self._guard.start(
                spec.command, cwd=spec.cwd, env=spec.environment, output=output, errors=errors
            )
        finally:
            self._close_pipes()

    def _close_pipes(self) -> None:
        """Close this process's copies of the child's ends: a pipe ends when the child has closed its own."""
        while self._pipes:
            os.close(self._pipes.pop())


class _Reader(asyncio.Protocol):
    """Reads a pipe to its end, without pausing: a full pipe would block the process."""

    def __init__(self, write: Callable[[Sequence[bytes]], None]) -> None:
        self.ended = asyncio.Event()
        self._lines = LineSplitter()
        self._write = write

    def data_received(self, data: bytes) -> None:
        """Pass on the lines that are complete now."""
        if lines := self._lines.feed(data):
            self._write(lines)

    def connection_lost(self, exc: Exception | None) -> None:
        """Note that all writers have closed the pipe."""
        del exc
        self.ended.set()

    def end(self) -> None:
        """Pass on the last line."""
        if lines := self._lines.end():
            self._write(lines)
