"""A process and its group: its end, its signals, and what is left of it."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import subprocess
import threading
from typing import TYPE_CHECKING, Any

import pytest

from actors.processes.process import Process
from proto.aio import process

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")


def shell(script: str) -> Process:
    """Start a shell that runs a script."""
    return Process(["/bin/sh", "-c", script], stdin=subprocess.DEVNULL)


@pytest.mark.parametrize("missing", [(), ("pidfd_open",), ("pidfd_open", "waitid")])
async def test_exit_codes_come_through(monkeypatch: pytest.MonkeyPatch, missing: Sequence[str]) -> None:
    """The code, or minus the signal; also where the system has no pidfd, or cannot wait without reaping."""
    for name in missing:
        monkeypatch.delattr(os, name, raising=False)
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
    ended = shell("exit 0")
    await ended.wait()
    ended.signal(signal.SIGKILL)
    assert ended.ended


async def test_what_cannot_be_started_is_an_os_error() -> None:
    """As from subprocess."""
    with pytest.raises(FileNotFoundError):
        Process(["/no/such/program"], stdin=subprocess.DEVNULL)


async def test_without_a_thread_there_is_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no pidfd, and no thread can be started to wait for it, the process is killed again."""

    class Refused:
        def __init__(self, **_: object) -> None:
            pass

        def start(self) -> None:
            raise RuntimeError("can't start new thread")

    monkeypatch.delattr(os, "pidfd_open", raising=False)
    monkeypatch.setattr("threading.Thread", Refused)
    with pytest.raises(RuntimeError, match="new thread"):
        shell("sleep 1000")


def descriptors() -> set[str]:
    """Return the descriptors of this process."""
    return set(os.listdir("/dev/fd"))  # noqa: PTH208 - a Path would open one more


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="needs pidfd")
@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, process.new_event_loop])
def test_a_pidfd_needs_no_thread_and_is_closed(new_loop: Callable[[], Any]) -> None:
    """A process costs one descriptor while it runs, also if it is killed."""

    async def scene() -> None:
        gc.collect()  # what earlier tests have left may end meanwhile
        threads, before = set(threading.enumerate()), descriptors()
        running, killed = shell("exit 3"), shell("sleep 1000")
        assert set(threading.enumerate()) <= threads
        assert await running.wait() == 3
        assert killed.reap() == -signal.SIGKILL
        assert descriptors() <= before

    with asyncio.Runner(loop_factory=new_loop) as runner:
        runner.run(scene())


@pytest.mark.parametrize("error", [PermissionError, ProcessLookupError])
async def test_a_pidfd_may_be_refused(monkeypatch: pytest.MonkeyPatch, error: type[OSError]) -> None:
    """A container may forbid it; a process that nobody has to reap may have ended before."""

    def refuse(pid: int) -> int:
        raise error(pid)

    monkeypatch.setattr(os, "pidfd_open", refuse, raising=False)
    assert await shell("exit 0").wait() in {0, -signal.SIGKILL}
