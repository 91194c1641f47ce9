"""Real processes under test: started in groups of their own, read line by line, and killed in the end."""

from __future__ import annotations

import asyncio
import os
import random
import signal
import socket
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

import broker

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Mapping

ROOT: Final = Path(__file__).parents[2]
DEADLINE_SEC: Final = 40.0
"""For any single event, on a machine that is busy with other tests. Nothing waits this long in vain."""


class Program:
    """A running process and what it has written, stdout and stderr in one."""

    def __init__(self, name: str, process: asyncio.subprocess.Process) -> None:
        self.name = name
        self.process = process
        self.lines: list[str] = []
        self._seen = 0
        self._more = asyncio.Condition()
        self._ended = False
        self._reader = asyncio.create_task(self._read())

    @property
    def output(self) -> str:
        """Everything it has written so far."""
        return "\n".join(self.lines)

    async def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while raw := await stream.readline():
            async with self._more:
                self.lines.append(raw.decode().rstrip("\n"))
                self._more.notify_all()
        async with self._more:
            self._ended = True
            self._more.notify_all()

    async def says(self, text: str) -> str:
        """Wait for the next line that has `text` in it; go on after it next time."""
        try:
            async with asyncio.timeout(DEADLINE_SEC), self._more:
                while True:
                    while self._seen < len(self.lines):
                        line = self.lines[self._seen]
                        self._seen += 1
                        if text in line:
                            return line
                    if self._ended:
                        raise AssertionError(f"{self.name} ended without saying {text!r}:\n{self.output}")
                    await self._more.wait()
        except TimeoutError:
            raise AssertionError(f"{self.name} did not say {text!r}:\n{self.output}") from None

    def skip(self) -> None:
        """Let `says` look only at what comes from now on."""
        self._seen = len(self.lines)

    def rewind(self) -> None:
        """Let `says` look at everything from the beginning again."""
        self._seen = 0

    async def ends(self) -> int:
        """Wait for the end; return the exit code (negative: the signal that killed it)."""
        try:
            async with asyncio.timeout(DEADLINE_SEC):
                await self._reader
                return await self.process.wait()
        except TimeoutError:
            raise AssertionError(f"{self.name} did not end:\n{self.output}") from None

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process alone."""
        self.process.send_signal(number)

    async def stop(self) -> int:
        """Send SIGINT and wait for the end."""
        self.send(signal.SIGINT)
        return await self.ends()

    async def kill(self) -> None:
        """Kill the whole process group and wait until it is gone."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        await self._reader
        await self.process.wait()


class System:
    """The processes of one test. `url` is where its programs look for a broker."""

    def __init__(self) -> None:
        self.port = free_port()
        self.url = f"callboard://127.0.0.1:{self.port}"
        self._programs: list[Program] = []

    async def broker(self, *args: str) -> Program:
        """Start the daemon where the programs look for it, and wait until it listens."""
        daemon = await self.python("-m", "broker", "--port", str(self.port), *args)
        await daemon.says(f"callboard broker listening on {self.url}")
        return daemon

    async def example(self, name: str, *args: str) -> Program:
        """Start one of the examples."""
        return await self.python(str(ROOT / "examples" / f"{name}.py"), *args)

    async def python(self, *args: str) -> Program:
        """Start a Python process."""
        return await self.program(sys.executable, *args)

    async def program(
        self,
        *command: str,
        folder: Path = ROOT,
        environ: Mapping[str, str] = os.environ,
        unbuffered: bool = True,
    ) -> Program:
        """Start a process, where and with what environment is wished beside the place of the broker.

        Python is told to write at once, unless the test is about who tells it so.
        """
        kept = {key: value for key, value in environ.items() if not key.startswith("CALLBOARD_")}
        kept.pop("PYTHONUNBUFFERED", None)
        if unbuffered:
            kept["PYTHONUNBUFFERED"] = "1"
        process = await asyncio.create_subprocess_exec(
            *command,
            cwd=folder,
            env=kept | {"CALLBOARD_URL": self.url, "NO_COLOR": "1"},
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            start_new_session=True,
        )
        program = Program(" ".join(command[1:]), process)
        self._programs.append(program)
        return program

    async def close(self) -> None:
        """Kill everything that still runs."""
        for program in self._programs:
            await program.kill()


def free_port() -> int:
    """Return a port that nobody listens on, outside the range from which the kernel hands out its own."""
    while True:
        port = random.SystemRandom().randrange(20_000, 30_000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


@pytest.fixture
async def system() -> AsyncIterator[System]:
    """A place to start processes; no broker runs yet."""
    processes = System()
    try:
        yield processes
    finally:
        await processes.close()


@pytest.fixture
async def hub() -> AsyncIterator[broker.Broker]:
    """A broker in this process."""
    async with broker.Broker(broker.BrokerOptions(port=0)) as running:
        yield running
