"""The processes of a trial: each in its own process group, controlled by lines on its pipes.

A role writes `{"event": "ready"}` when it is set up, begins when it reads `go`, and writes `{"event": "done",
...}` with its figures; a held role does so when its stdin closes. Leaving `TrialProcesses` kills and reaps
them all, also after Ctrl-C.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Self

import msgspec

from benchmarks.harness.contender import SCRATCH, Contender
from benchmarks.harness.errors import TrialError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

READY_TIMEOUT_S: Final = 60.0
"""From a role's start to its `ready`: 10,000 connections take a while."""
SERVER_TIMEOUT_S: Final = 20.0
END_TIMEOUT_S: Final = 60.0
"""From a role's figures to its end: 10,000 connections take a while to close, too."""
REAP_TIMEOUT_S: Final = 10.0
_CONNECT_INTERVAL_S: Final = 0.01
"""Servers do not report when they listen, so the trial tries to connect this often."""
_LOG_LINES: Final = 5
"""Lines at the end of a process's log that an error shows."""


_LAUNCHER: Final = """
import ctypes, os, signal, sys
PR_SET_PDEATHSIG = 1
ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]):
    sys.exit("the parent process has ended")
os.execvp(sys.argv[2], sys.argv[2:])
"""


def killed_with_parent(command: Sequence[str]) -> Sequence[str]:
    """Return a command that the kernel kills when this process is killed.

    Roles notice that by their stdin; servers do not. A launcher that sets this and then executes the command
    needs no code between fork and exec, where other threads of this process could cause a deadlock.
    """
    if sys.platform != "linux":
        return command
    return (sys.executable, "-I", "-S", "-c", _LAUNCHER, str(os.getpid()), *command)


class Child:
    """A process in a group of its own; stderr goes to a file."""

    def __init__(self, name: str, process: asyncio.subprocess.Process, log: Path) -> None:
        self.name = name
        self.pid = process.pid
        self._process = process
        self._log = log

    @classmethod
    async def start(
        cls,
        name: str,
        command: Sequence[str],
        scratch: Path,
        *,
        pipes: bool,
        variables: Mapping[str, str] | None = None,
    ) -> Self:
        """Start a process; `pipes` connects its stdin and stdout to this process.

        `variables` are added to its environment.
        """
        log = scratch / f"{name}.log"
        with log.open("wb") as file:
            process = await asyncio.create_subprocess_exec(
                *killed_with_parent(command),
                stdin=subprocess.PIPE if pipes else subprocess.DEVNULL,
                stdout=subprocess.PIPE if pipes else file,
                stderr=file,
                start_new_session=True,
                env={**os.environ, **(variables or {})},
            )
        return cls(name, process, log)

    @property
    def exit_code(self) -> int | None:
        """The exit code of a process that has ended."""
        return self._process.returncode

    def failure(self, what: str) -> TrialError:
        """Return an error with the end of the process's log."""
        lines = self._log.read_text("utf-8", "replace").splitlines()[-_LOG_LINES:]
        return TrialError("\n".join([f"{self.name} {what}", *(f"    {line}" for line in lines)]))

    def kill(self) -> None:
        """Kill the process group, unless it has been reaped: its id may have been reused."""
        if self._process.returncode is not None:
            return
        with suppress(ProcessLookupError):
            if hasattr(os, "killpg"):
                os.killpg(self.pid, signal.SIGKILL)
            else:
                self._process.kill()

    async def reap(self) -> None:
        """Wait for the end of a killed process."""
        async with asyncio.timeout(REAP_TIMEOUT_S):
            await self._process.wait()


class RoleProcess(Child):
    """A process of a role: reports that it is ready, runs, and reports its figures."""

    async def ready(self) -> None:
        """Wait until it is set up.

        Raises:
            TrialError: It ended, or wrote something else, or nothing in time.
        """
        await self._event("ready", READY_TIMEOUT_S)

    async def go(self) -> None:
        """Start its load."""
        await self._write(b"go\n")

    async def release(self) -> None:
        """Close its stdin: a held role ends."""
        stdin = self._process.stdin
        assert stdin is not None
        stdin.close()
        with suppress(BrokenPipeError, ConnectionResetError):  # it has already ended
            await stdin.wait_closed()

    async def done(self, timeout_s: float) -> dict[str, Any]:
        """Wait for its figures.

        Raises:
            TrialError: It ended without figures, failed afterwards, or took longer.
        """
        figures = await self._event("done", timeout_s)
        try:
            async with asyncio.timeout(END_TIMEOUT_S):
                code = await self._process.wait()
        except TimeoutError:
            raise self.failure(f"reported and did not end within {END_TIMEOUT_S:g} s") from None
        if code:
            raise self.failure(f"reported and then ended with {code}")
        return figures

    async def _write(self, line: bytes) -> None:
        stdin = self._process.stdin
        assert stdin is not None
        try:
            stdin.write(line)
            await stdin.drain()
        except (BrokenPipeError, ConnectionResetError):
            raise self.failure("ended before its start") from None

    async def _event(self, event: str, timeout_s: float) -> dict[str, Any]:
        stdout = self._process.stdout
        assert stdout is not None
        try:
            async with asyncio.timeout(timeout_s):
                raw = await stdout.readline()
                if not raw:
                    raise self.failure(f"ended with {await self._process.wait()} before it was {event}")
        except TimeoutError:
            raise self.failure(f"was not {event} within {timeout_s:g} s") from None
        try:
            report = msgspec.json.decode(raw, type=dict[str, Any])
        except msgspec.DecodeError:
            report = {}
        if report.get("event") != event:
            raise self.failure(f"wrote {raw!r} instead of '{event}'")
        return report


class TrialProcesses:
    """One trial's processes: a server, if the contender has one, and roles."""

    def __init__(self, contender: Contender, scratch: Path) -> None:
        self.contender = contender
        self.server: Child | None = None
        self.url = ""
        self._scratch = scratch
        self._children: list[Child] = []

    async def __aenter__(self) -> Self:
        """Start the server and wait until it listens."""
        try:
            await self._start_server()
        except BaseException:
            await self._clear()
            raise
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Kill and reap everything."""
        await self._clear()

    async def _start_server(self) -> None:
        contender = self.contender
        port = free_port()
        self.url = contender.server_url(port).replace(SCRATCH, str(self._scratch))
        if contender.server_command is None:
            return
        command = contender.server_command(port, self._scratch)
        self.server = await Child.start("server", command, self._scratch, pipes=False)
        self._children.append(self.server)
        try:
            async with asyncio.timeout(SERVER_TIMEOUT_S):
                while not self._listens(port):
                    if self.server.exit_code is not None:
                        raise self.server.failure(f"ended with {self.server.exit_code}")
                    await asyncio.sleep(_CONNECT_INTERVAL_S)
        except TimeoutError:
            raise self.server.failure(f"did not listen within {SERVER_TIMEOUT_S:g} s") from None

    def _listens(self, port: int) -> bool:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except ConnectionRefusedError:
            return False
        return True

    async def add(self, role: str, parameters: Mapping[str, object]) -> RoleProcess:
        """Start a role and wait until it is ready."""
        argument = json.dumps({"role": role, "url": self.url, **parameters})
        command = (*self.contender.role_command, argument)
        name = f"{role}{len(self._children)}"
        variables = {
            key: value.replace(SCRATCH, str(self._scratch)) for key, value in self.contender.variables.items()
        }
        process = await RoleProcess.start(name, command, self._scratch, pipes=True, variables=variables)
        self._children.append(process)
        await process.ready()
        return process

    async def _clear(self) -> None:
        # Kill all before the first await, so that a second Ctrl-C cannot leave one running.
        for child in self._children:
            child.kill()
        for child in self._children:
            await child.reap()
        self._children.clear()


def free_port() -> int:
    """Return a TCP port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
