"""A process of the launch: how it is stopped, and what is said of that."""

from __future__ import annotations

import asyncio
import contextvars
import os
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.process import LaunchedProcess
from actors.launch.steps import ProcessSpec
from actors.supervision.guard import Guard

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.events import Stream
    from actors.supervision.outcome import Outcome

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

DEAF = "trap '' INT TERM; echo deaf; while :; do sleep 1000; done"


class Run:
    """One run of a shell script.

    Attributes:
        process: The process.
        output: What it has written.
        outcome: How it ends.
    """

    def __init__(self, guard: Guard, script: str, *, stop_timeout_sec: float = 1000, **options: Any) -> None:
        command = ("/bin/sh", "-c", script)
        spec = ProcessSpec(
            label="script-1",
            name="script",
            command=command,
            shown="script",
            environment=os.environ,
            **options,
        )
        self.output = b""
        self.said: list[str] = []
        self._more = asyncio.Event()
        self.outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self.process = LaunchedProcess(
            spec,
            guard,
            split=False,
            write=self._write,
            say=lambda level, text: self.said.append(f"{level.value} {text}"),
            stop_timeout_sec=stop_timeout_sec,
            on_started=lambda: None,
            on_ended=self.outcome.set_result,
        )
        self.process.start(contextvars.copy_context())

    async def says(self, text: bytes) -> None:
        """Wait for something in its output."""
        while text not in self.output:
            self._more.clear()
            await self._more.wait()

    def _write(self, stream: Stream, lines: Sequence[bytes]) -> None:
        self.output += b"".join(line + b"\n" for line in lines)
        self._more.set()


async def test_each_signal_has_a_wait_of_its_own() -> None:
    """The launch's wait would be too long for this test; what has happened is said as of a process."""
    guard = Guard()
    run = Run(guard, DEAF, sigterm_timeout_sec=0.05, sigkill_timeout_sec=0.1)
    await run.says(b"deaf")
    run.process.stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert run.said == [
        "WARN process has not ended after SIGINT; sending SIGTERM",
        "WARN process has not ended after SIGTERM; sending SIGKILL",
    ]


async def test_the_launchs_wait_stands_in() -> None:
    """For each wait that the process does not have itself."""
    guard = Guard()
    run = Run(guard, DEAF, stop_timeout_sec=0.05)
    await run.says(b"deaf")
    run.process.stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert len(run.said) == 2


async def test_a_hurried_process_is_killed_at_once() -> None:
    """Nothing is said of signals that it never got."""
    guard = Guard()
    run = Run(guard, DEAF)
    await run.says(b"deaf")
    run.process.hurry()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert run.said == ["WARN process is killed"]
