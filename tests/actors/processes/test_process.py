"""A process and its group: its end, its signals, and what is left of it."""

from __future__ import annotations

import os
import signal
import subprocess
from typing import TYPE_CHECKING

import pytest

from actors.processes.process import Process

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")


def shell(script: str) -> Process:
    """Start a shell that runs a script."""
    return Process(["/bin/sh", "-c", script], stdin=subprocess.DEVNULL)


@pytest.mark.parametrize("leaves_zombies", [True, False])
async def test_exit_codes_come_through(monkeypatch: pytest.MonkeyPatch, *, leaves_zombies: bool) -> None:
    """The code, or minus the signal; also where the system cannot wait without reaping (macOS)."""
    if not leaves_zombies:
        monkeypatch.delattr("os.waitid")
    assert await shell("exit 3").wait() == 3
    assert await shell("kill -s TERM $$").wait() == -signal.SIGTERM


async def test_the_group_ends_with_its_leader(tmp_path: Path) -> None:
    """What the process has left running holds its end of a pipe no longer than until `wait` returns."""
    path = tmp_path / "alive"
    os.mkfifo(path)
    holder = shell(f"sleep 1000 >{path} & exit 0")
    end = os.open(path, os.O_RDONLY)
    try:
        assert await holder.wait() == 0
        assert os.read(end, 1) == b""
    finally:
        os.close(end)


async def test_a_signal_after_the_end_goes_nowhere() -> None:
    """Its number may be another's by then."""
    process = shell("exit 0")
    await process.wait()
    process.signal(signal.SIGKILL)
    assert process.ended


async def test_what_cannot_be_started_is_an_os_error() -> None:
    """As from subprocess."""
    with pytest.raises(FileNotFoundError):
        Process(["/no/such/program"], stdin=subprocess.DEVNULL)


async def test_without_a_thread_there_is_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no thread can be started to wait for it, the process is killed again."""

    class Refused:
        def __init__(self, **_: object) -> None:
            pass

        def start(self) -> None:
            raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread", Refused)
    with pytest.raises(RuntimeError, match="new thread"):
        shell("sleep 1000")
