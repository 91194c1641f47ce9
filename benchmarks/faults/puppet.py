"""Processes that a measurement starts, listens to, and kills: brokers, puppets that play a role, spinners.

A puppet writes JSON lines with an "event" and reads words. Leaving `Theatre` kills and reaps everything.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any, Final, Self

from actors.bench.errors import TrialError
from actors.bench.processes import Child, free_port

EVENT_TIMEOUT_S: Final = 60.0
"""For whatever a puppet is to say next. Nothing waits this long in vain."""

ROLES: Final = "benchmarks.faults.roles"
LISTENING: Final = b"callboard broker listening"


class Puppet(Child):
    """A process that writes events to its stdout and reads words from its stdin."""

    async def line(self) -> bytes:
        """Return its next line.

        Raises:
            TrialError: It ended, or wrote nothing in time.
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

    async def hears(self, event: str) -> dict[str, Any]:
        """Wait for an event, which must be the next; return what comes with it."""
        line = await self.line()
        report: dict[str, Any] = json.loads(line) if line.startswith(b"{") else {}
        if report.get("event") != event:
            raise self.failure(f"wrote {line!r} instead of '{event}'")
        return report

    async def send(self, word: str) -> None:
        """Tell it a word."""
        stdin = self._process.stdin
        assert stdin is not None
        stdin.write(word.encode() + b"\n")
        await stdin.drain()

    async def end(self) -> None:
        """Kill it and wait until it is gone."""
        self.kill()
        await self.reap()


class Theatre:
    """The processes of one measurement, and the port at which their broker is, again and again."""

    def __init__(self) -> None:
        self.port = free_port()
        self.url = f"callboard://127.0.0.1:{self.port}"
        self._scratch = tempfile.TemporaryDirectory(prefix="callboard-faults-")
        self._children: dict[Puppet, None] = {}
        self._started = 0

    async def __aenter__(self) -> Self:
        """Nothing runs yet."""
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Kill and reap everything."""
        for child in self._children:
            child.kill()
        for child in self._children:
            await child.reap()
        self._scratch.cleanup()

    async def broker(self, *arguments: str) -> Puppet:
        """Start the broker at the port, and wait until it listens."""
        command = ["-m", "broker", "--port", str(self.port), "--log-level", "error", *arguments]
        daemon = await self._start("broker", command)
        if not (await daemon.line()).startswith(LISTENING):
            raise daemon.failure("does not listen")
        return daemon

    async def play(self, role: str, **parameters: object) -> Puppet:
        """Start a puppet; it says when it is ready."""
        return await self._start(
            role, ["-m", ROLES, json.dumps({"role": role, "url": self.url, **parameters})]
        )

    async def spin(self, count: int) -> None:
        """Keep so many cores busy until the end."""
        for _ in range(count):
            await self._start("spinner", ["-c", "while True: pass"])

    async def _start(self, name: str, arguments: list[str]) -> Puppet:
        self._started += 1
        name = f"{name}{self._started}"
        child = await Puppet.start(name, [sys.executable, *arguments], Path(self._scratch.name), pipes=True)
        self._children[child] = None
        return child

    async def end(self, puppet: Puppet) -> None:
        """Kill one and forget it."""
        await puppet.end()
        del self._children[puppet]


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


__all__ = ["Puppet", "Theatre", "TrialError", "cores"]
