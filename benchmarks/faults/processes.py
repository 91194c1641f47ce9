"""Processes that a measurement starts, controls and kills: brokers, roles, and busy loops.

A process in a role writes events as JSON lines to stdout and reads commands from stdin.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any, Final, Self

from benchmarks.harness.errors import TrialError
from benchmarks.harness.processes import Child, free_port

EVENT_TIMEOUT_S: Final = 60.0
"""Limit for the next event of a process."""

ROLES: Final = "benchmarks.faults.roles"
LISTENING: Final = b"callboard broker listening"


class ControlledProcess(Child):
    """A process that writes events to stdout and reads commands from stdin."""

    async def read_line(self) -> bytes:
        """Return its next line.

        Raises:
            TrialError: The process ended, or wrote nothing within the limit.
        """
        stdout = self._process.stdout
        assert stdout is not None
        try:
            async with asyncio.timeout(EVENT_TIMEOUT_S):
                line = await stdout.readline()
        except TimeoutError:
            raise self.failure(f"wrote nothing for {EVENT_TIMEOUT_S:g} s") from None
        if not line:
            raise self.failure("ended too early")
        return line

    async def wait_for_event(self, event: str) -> dict[str, Any]:
        """Return the next event, which must be this one, with its values."""
        line = await self.read_line()
        document: dict[str, Any] = json.loads(line) if line.startswith(b"{") else {}
        if document.get("event") != event:
            raise self.failure(f"wrote {line!r} instead of event '{event}'")
        return document

    async def send_command(self, command: str) -> None:
        """Write a command to its stdin."""
        stdin = self._process.stdin
        assert stdin is not None
        stdin.write(command.encode() + b"\n")
        await stdin.drain()

    async def stop(self) -> None:
        """Kill the process and wait for its end."""
        self.kill()
        await self.reap()


class ProcessGroup:
    """The processes of one measurement, and the port of their broker. Leaving it kills them all."""

    def __init__(self) -> None:
        self.port = free_port()
        self.url = f"callboard://127.0.0.1:{self.port}"
        self._scratch = tempfile.TemporaryDirectory(prefix="callboard-faults-")
        self._children: dict[ControlledProcess, None] = {}
        self._started = 0

    async def __aenter__(self) -> Self:
        """Start nothing yet."""
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Kill and reap all processes."""
        for child in self._children:
            child.kill()
        for child in self._children:
            await child.reap()
        self._scratch.cleanup()

    async def start_broker(self, *arguments: str) -> ControlledProcess:
        """Start a broker on the port and wait until it listens."""
        command = ["-m", "broker", "--port", str(self.port), "--log-level", "error", *arguments]
        daemon = await self.start("broker", command)
        if not (await daemon.read_line()).startswith(LISTENING):
            raise daemon.failure("does not listen")
        return daemon

    async def start_role(self, role: str, **parameters: object) -> ControlledProcess:
        """Start a process in a role; it reports when it is ready."""
        return await self.start(
            role, ["-m", ROLES, json.dumps({"role": role, "url": self.url, **parameters})]
        )

    async def load_cores(self, count: int) -> None:
        """Keep `count` cores busy until the group is left."""
        for _ in range(count):
            await self.start("spinner", ["-c", "while True: pass"])

    async def start(self, name: str, arguments: list[str]) -> ControlledProcess:
        """Start Python with these arguments; the environment names the broker."""
        self._started += 1
        name = f"{name}{self._started}"
        child = await ControlledProcess.start(
            name,
            [sys.executable, *arguments],
            Path(self._scratch.name),
            pipes=True,
            variables={"CALLBOARD_URL": self.url},
        )
        self._children[child] = None
        return child

    async def stop(self, process: ControlledProcess) -> None:
        """Kill one process and forget it."""
        await process.stop()
        del self._children[process]


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


__all__ = ["ControlledProcess", "ProcessGroup", "TrialError", "cores"]
