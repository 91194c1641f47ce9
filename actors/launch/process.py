"""A process of the launch: under guard, and its lines labelled."""

from __future__ import annotations

import asyncio
import os
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from actors.launch.lines import Lines
from actors.supervision.process_body import ProcessBody
from actors.supervision.specification import Child

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.steps import ProcessSpec
    from actors.logger import Logger, LoggingSeverity
    from actors.supervision.guard import Guard
    from actors.supervision.outcome import Outcome
    from actors.supervision.process import Process

REST_TIMEOUT_SEC: Final = 1.0
"""How long its pipe is read after its end. Only what has left its group can hold the pipe open."""


class LaunchedProcess(ProcessBody):
    """One run of a process. It is stopped as a supervisor's child is: SIGINT, SIGTERM, SIGKILL.

    Args:
        spec: What to run.
        guard: Kills it if this process is killed.
        log: Gets what goes wrong.
        write: Takes its lines, labelled.
        stop_timeout_sec: What each step of stopping it may take, unless the specification says otherwise.
        reports: As a body's.
    """

    def __init__(
        self,
        spec: ProcessSpec,
        guard: Guard,
        log: Logger,
        *,
        write: Callable[[bytes], None],
        stop_timeout_sec: float,
        **reports: Any,
    ) -> None:
        child = Child(spec.label, command=spec.command, cwd=spec.cwd, stop_timeout_sec=stop_timeout_sec)
        super().__init__(child, guard, log, **reports)
        self._spec = spec
        self._write = write
        self._pipe = -1

    async def _run(self) -> Outcome:
        reading, self._pipe = os.pipe()
        source = os.fdopen(reading, "rb", buffering=0)
        try:
            lines = _Reader(self._spec.label, self._write)
            transport, _ = await asyncio.get_running_loop().connect_read_pipe(lambda: lines, source)
        except BaseException:
            source.close()
            self._close_pipe()
            raise
        try:
            outcome = await super()._run()
            with suppress(TimeoutError):
                async with asyncio.timeout(REST_TIMEOUT_SEC):
                    await lines.over.wait()
            return outcome
        finally:
            self._close_pipe()
            transport.close()
            lines.end()

    def _patience_sec(self, rung: int) -> float:
        own = (self._spec.sigterm_timeout_sec, self._spec.sigkill_timeout_sec)[rung]
        return super()._patience_sec(rung) if own is None else own

    def _report(self, severity: LoggingSeverity, text: str) -> None:
        self._log.log(f"process {text}", severity)

    def _begin(self) -> Process:
        spec = self._spec
        try:
            return self._guard.start(spec.command, cwd=spec.cwd, env=spec.environment, output=self._pipe)
        finally:
            self._close_pipe()

    def _close_pipe(self) -> None:
        """Close this process's copy of the child's end: the pipe ends when the child has closed its own."""
        if self._pipe >= 0:
            os.close(self._pipe)
            self._pipe = -1


class _Reader(asyncio.Protocol):
    """Reads a pipe to its end; never pauses."""

    def __init__(self, label: str, write: Callable[[bytes], None]) -> None:
        self.over = asyncio.Event()
        self._lines = Lines()
        self._label = f"[{label}] ".encode()
        self._write = write

    def data_received(self, data: bytes) -> None:
        """Something came."""
        self._say(self._lines.feed(data))

    def connection_lost(self, exc: Exception | None) -> None:
        """All writers have closed it."""
        del exc
        self.over.set()

    def end(self) -> None:
        """Write the last line."""
        self._say(self._lines.end())

    def _say(self, lines: list[bytes]) -> None:
        self._write(b"".join(self._label + line + b"\n" for line in lines))
