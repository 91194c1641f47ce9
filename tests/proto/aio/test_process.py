"""The configuration of a process: its event loop, allocator and garbage collector."""

from __future__ import annotations

import asyncio
import ctypes
import gc
import subprocess
import sys

import pytest

from proto.aio import process


def test_the_loop_is_uvloops_where_there_is_one() -> None:
    """It comes from uvloop's own factory."""
    uvloop = pytest.importorskip("uvloop")
    loop = process.new_event_loop()
    loop.close()
    assert isinstance(loop, uvloop.Loop)


def test_without_uvloop_the_loop_is_asyncios(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows."""
    monkeypatch.setitem(sys.modules, "uvloop", None)
    loop = process.new_event_loop()
    loop.close()
    assert isinstance(loop, asyncio.BaseEventLoop)


@pytest.mark.processes
def test_loaded_objects_are_frozen() -> None:
    """After the configuration, the collector skips imported objects."""
    code = (
        "import gc; from proto.aio.process import configure_process; configure_process();"
        "print(gc.get_freeze_count() > 1000)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout.strip() == "True"


@pytest.mark.processes
def test_many_waiting_objects_cause_no_full_collection() -> None:
    """Case 46: half a million objects that a broker keeps do not let its collector look at all of them."""
    code = (
        "import gc; from proto.aio import process; process.configure_process();"
        "process.make_full_collections_rare();"
        "before = gc.get_stats()[2]['collections']; kept = [[] for _ in range(500_000)];"
        "print(gc.get_stats()[2]['collections'] - before)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout.strip() == "0"


@pytest.mark.parametrize("error", [OSError, TypeError, AttributeError])
def test_a_platform_without_mallopt_is_left_as_it_is(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    """Other C libraries have no mallopt, and Windows no library without a name."""
    asked: list[object] = []

    def missing(name: object) -> object:
        asked.append(name)
        raise error

    monkeypatch.setattr(ctypes, "CDLL", missing)
    for name in ("collect", "freeze"):  # frozen is what all tests share
        monkeypatch.setattr(gc, name, lambda: None)
    process.configure_process()
    assert asked == [None]


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell")
@pytest.mark.processes
def test_a_loop_runs_though_streams_are_closed() -> None:
    """They are the null device then, and no descriptor of the loop takes their numbers."""
    code = (
        "import asyncio, os, stat; from proto.aio import process; loop = process.new_event_loop();"
        "loop.run_until_complete(asyncio.sleep(0)); loop.close();"
        "raise SystemExit(not all(os.path.samestat(os.fstat(n), os.stat(os.devnull)) for n in range(3)))"
    )
    command = ["/bin/sh", "-c", 'exec "$0" -c "$1" <&- >&- 2>&-', sys.executable, code]
    assert subprocess.run(command, check=False, timeout=30).returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="has no such limit")
@pytest.mark.parametrize(
    ("limits", "wanted", "result"),
    [((256, 9999), None, 9999), ((256, 9999), 4096, 4096), ((256, 1024), 4096, 1024)],
)
def test_the_limit_of_open_files_is_raised_as_far_as_it_goes(
    monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int], wanted: int | None, result: int
) -> None:
    """Only upward, to the hard limit at most; a system that refuses keeps its limit."""
    import resource  # noqa: PLC0415 - not on Windows

    soft, hard = limits
    asked: list[tuple[int, int]] = []

    def take(_: int, limits: tuple[int, int]) -> None:
        asked.append(limits)

    def refuse(_: int, limits: tuple[int, int]) -> None:
        raise ValueError(limits)

    monkeypatch.setattr(resource, "getrlimit", lambda _: limits)
    monkeypatch.setattr(resource, "setrlimit", take)
    assert process.raise_file_limit(wanted) == result
    assert asked == [(result, hard)]
    monkeypatch.setattr(resource, "setrlimit", refuse)
    assert process.raise_file_limit(wanted) == soft


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs glibc and /proc")
@pytest.mark.processes
def test_freed_memory_is_returned_on_request() -> None:
    """Case 46: blocks below one that lives stay with malloc until `return_memory`."""
    if not hasattr(ctypes.CDLL(None), "malloc_trim"):
        pytest.skip("not glibc")
    code = (
        "from proto.aio.machine_memory import resident_bytes; from proto.aio import process;"
        "process.return_memory(); process.configure_process();"
        "blocks = [bytes(60_000) for _ in range(2000)]; last = bytes(60_000); del blocks;"
        "before = resident_bytes(); process.return_memory(); print(before - resident_bytes())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert int(done.stdout) > 80_000_000
