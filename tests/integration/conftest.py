"""Processes under test: started in groups of their own, read line by line, and killed at the end."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

import broker
from tests.fork_server import client
from tests.ports import hold_port
from tests.seams.limits import be_patient
from tests.waiting import until

if TYPE_CHECKING:
    import socket
    from collections.abc import AsyncIterator, Iterator, Mapping

    import actors

ROOT: Final = Path(__file__).parents[2]
DEADLINE_SEC: Final = 40.0
"""Limit for a single event, on a machine that is busy with other tests."""
NO_KEEPALIVE: Final = ("--keepalive-sec", "1000")
"""Broker options for tests of what is noticed without the keepalive."""


class Program:
    """A running process and its output, with stdout and stderr combined."""

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
        """All output so far."""
        return "\n".join(self.lines)

    @property
    def ended(self) -> bool:
        """Whether there will be no more output."""
        return self._ended

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

    async def wait_for_line(self, text: str) -> str:
        """Wait for the next line that contains `text`; the next call continues after it."""
        try:
            async with asyncio.timeout(DEADLINE_SEC), self._more:
                while True:
                    while self._seen < len(self.lines):
                        line = self.lines[self._seen]
                        self._seen += 1
                        if text in line:
                            return line
                    if self._ended:
                        raise AssertionError(f"{self.name} ended without printing {text!r}:\n{self.output}")
                    await self._more.wait()
        except TimeoutError:
            raise AssertionError(f"{self.name} did not print {text!r}:\n{self.output}") from None

    def skip(self) -> None:
        """Ignore the lines written so far in `wait_for_line`."""
        self._seen = len(self.lines)

    async def find_line(self, text: str) -> str:
        """Wait for a line with `text` in it among all lines, earlier ones included."""
        self._seen = 0
        return await self.wait_for_line(text)

    async def wait_for_exit(self, limit_sec: float = DEADLINE_SEC) -> int:
        """Wait for the end; return the exit code (negative: number of the signal that killed it)."""
        try:
            async with asyncio.timeout(limit_sec):
                await asyncio.shield(self._reader)  # `kill` waits for it, too
                return await self.process.wait()
        except TimeoutError:
            raise AssertionError(f"{self.name} did not end:\n{self.output}") from None

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal to the process alone."""
        self.process.send_signal(number)

    async def stop(self) -> int:
        """Send SIGINT, wait for the end, and return the exit code."""
        self.send_signal(signal.SIGINT)
        return await self.wait_for_exit()

    async def kill(self) -> None:
        """Kill the process group and wait for its end."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        await self._reader
        await self.process.wait()


class System:
    """The processes of one test; `url` is the broker URL of its programs, `variables` are further ones."""

    def __init__(self) -> None:
        self.port = free_port()
        self.url = f"callboard://127.0.0.1:{self.port}"
        self.variables: dict[str, str] = {}
        self._programs: list[Program] = []

    async def broker(self, *args: str) -> Program:
        """Start a broker daemon at `url` and wait until it listens."""
        daemon = await self.python("-m", "broker", "--port", str(self.port), *args)
        await daemon.wait_for_line(f"callboard broker listening on {self.url}")
        return daemon

    async def example(self, name: str, *args: str) -> Program:
        """Start one of the examples."""
        return await self.python(str(ROOT / "examples" / f"{name}.py"), *args)

    async def python(self, *args: str, forked: bool = True) -> Program:
        """Start a Python process."""
        return await self.program(sys.executable, *args, forked=forked)

    async def program(
        self,
        *command: str,
        folder: Path = ROOT,
        environ: Mapping[str, str] = os.environ,
        unbuffered: bool = True,
        forked: bool = True,
    ) -> Program:
        """Start a process in a folder, with an environment that names the broker.

        Args:
            command: The program and its arguments.
            folder: The working directory.
            environ: The environment, without CALLBOARD variables.
            unbuffered: Whether to set PYTHONUNBUFFERED.
            forked: Whether a program may come from a fork server.
        """
        kept = {key: value for key, value in environ.items() if not key.startswith("CALLBOARD_")}
        kept.pop("PYTHONUNBUFFERED", None)
        if unbuffered:
            kept["PYTHONUNBUFFERED"] = "1"
        process = await asyncio.create_subprocess_exec(
            *command,
            executable=client.forked(command[0]) if forked else None,
            cwd=folder,
            env=kept | {"CALLBOARD_URL": self.url, "NO_COLOR": "1"} | self.variables,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            start_new_session=True,
        )
        program = Program(" ".join(command[1:]), process)
        self._programs.append(program)
        return program

    async def close(self) -> None:
        """Kill all processes that still run."""
        for program in self._programs:
            await program.kill()


async def wait_for_subscriptions(publisher: actors.Publisher[Any], count: int = 1) -> None:
    """Wait until a publisher is matched with exactly `count` subscriptions."""
    found = publisher.get_subscription_count
    await until(lambda: found() == count, f"{count} subscriptions", deadline_sec=DEADLINE_SEC)


_HELD: Final[list[socket.socket]] = []
"""They hold the ports of the running test."""


def free_port() -> int:
    """Return a port that the running test has for itself."""
    holder = hold_port()
    _HELD.append(holder)
    port: int = holder.getsockname()[1]
    return port


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes of this process wait long for a broker."""
    be_patient(monkeypatch)


@pytest.fixture(autouse=True)
def _held_ports() -> Iterator[None]:
    """Ports are free again after their test."""
    yield
    while _HELD:
        _HELD.pop().close()


@pytest.fixture
async def system() -> AsyncIterator[System]:
    """A starter of processes; no broker runs yet."""
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
