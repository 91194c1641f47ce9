"""The guard's list: whom it kills when the pipe closes, and whom it leaves alone."""

from __future__ import annotations

import os
import signal
import subprocess
from typing import TYPE_CHECKING

import pytest

from actors.processes.guard import Guard
from actors.processes.process import Process
from tests.seams.processes import tell_again

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")


def running(guard: Guard, pipe: Path) -> Process:
    """Start a process under guard, and wait until it has told the guard of itself."""
    os.mkfifo(pipe)
    process = guard.start(["/bin/sh", "-c", f"echo >{pipe}; exec sleep 1000"], cwd=None, env=None)
    pipe.read_bytes()
    return process


async def never_told() -> int:
    """Return the number of a group that is gone without having told the guard of itself."""
    process = Process(["/bin/sh", "-c", "exit 0"], stdin=subprocess.DEVNULL)
    await process.wait()
    return process.pid


@pytest.mark.parametrize("told", ["once", "twice"])
@pytest.mark.parametrize("strangers", [0, 3])
async def test_only_what_was_told_and_not_forgotten_is_killed(
    tmp_path: Path, told: str, strangers: int
) -> None:
    """A forgotten number may be a stranger's: also when another was forgotten that was never told."""
    guard = Guard()
    stranger = running(guard, tmp_path / "stranger")
    child = running(guard, tmp_path / "child")
    if told == "twice":
        tell_again(guard, stranger.pid)
    for _ in range(strangers):
        guard.forget(await never_told())
    guard.forget(stranger.pid)
    await guard.close()
    stranger.signal(signal.SIGTERM)
    assert await child.wait() == -signal.SIGKILL
    assert await stranger.wait() == -signal.SIGTERM
