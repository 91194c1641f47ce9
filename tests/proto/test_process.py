"""Setting up a process: the loop it gets, and that nothing it does can fail."""

from __future__ import annotations

import asyncio
import ctypes
import subprocess
import sys

import pytest

from proto import process


def test_the_loop_is_uvloops_where_there_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without uvloop (Windows) it is asyncio's own."""
    loop = process.new_event_loop()
    loop.close()
    monkeypatch.setitem(sys.modules, "uvloop", None)
    plain = process.new_event_loop()
    plain.close()
    assert isinstance(plain, asyncio.BaseEventLoop)
    assert not isinstance(loop, type(plain))


def test_what_is_loaded_is_frozen() -> None:
    """After settling, the collector leaves alone what was imported."""
    code = "import gc; from proto import process; process.settle(); print(gc.get_freeze_count() > 1000)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout.strip() == "True"


@pytest.mark.parametrize("error", [OSError, TypeError, AttributeError])
def test_a_platform_without_mallopt_is_left_as_it_is(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    """Other C libraries have no mallopt, and Windows no library without a name."""

    def missing(name: object) -> object:
        raise error

    monkeypatch.setattr(ctypes, "CDLL", missing)
    process.settle()
