"""Pseudo terminals: what a program sees of one, and what comes out of it, on both loops."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.processes.pseudo_terminal import CAN_EMULATE, open_terminal
from proto.aio import process

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.skipif(not CAN_EMULATE, reason="needs pseudo terminals")

LOOPS = [asyncio.new_event_loop, process.new_event_loop]

LOOK = """
import os, sys
size = os.get_terminal_size(1)
print("terminal", os.isatty(1), size.columns, size.lines)
sys.stdout.write("no end")
"""


class Reader(asyncio.Protocol):
    """Reads to the end."""

    def __init__(self) -> None:
        self.data = b""
        self.end: asyncio.Future[Exception | None] = asyncio.get_running_loop().create_future()

    def data_received(self, data: bytes) -> None:
        self.data += data

    def connection_lost(self, exc: Exception | None) -> None:
        self.end.set_result(exc)


def start(source: str, output: int) -> subprocess.Popen[bytes]:
    """Start a Python program."""
    return subprocess.Popen([sys.executable, "-c", source], stdout=output, stdin=subprocess.DEVNULL)


async def run(source: str) -> bytes:
    """Run a program on a terminal; return what it writes."""
    reading, writing = open_terminal()
    reader = Reader()
    file = os.fdopen(reading, "rb", buffering=0)
    transport, _ = await asyncio.get_running_loop().connect_read_pipe(lambda: reader, file)
    try:
        program = start(source, writing)
    finally:
        os.close(writing)
    await reader.end
    transport.close()
    await asyncio.to_thread(program.wait)
    return reader.data


@pytest.mark.parametrize("new_loop", LOOPS)
def test_a_program_sees_a_terminal(
    new_loop: Callable[[], Any], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Of the launch's size; all it writes comes, with its own line ends; the end is no error."""
    monkeypatch.setattr("os.get_terminal_size", lambda: os.terminal_size((123, 45)))
    with asyncio.Runner(loop_factory=new_loop) as runner:
        assert runner.run(run(LOOK)) == b"terminal True 123 45\nno end"
    assert not caplog.records


@pytest.mark.parametrize("new_loop", LOOPS)
def test_much_comes_whole(new_loop: Callable[[], Any]) -> None:
    """More than a terminal holds, up to the last byte before its end."""
    with asyncio.Runner(loop_factory=new_loop) as runner:
        assert runner.run(run("print('x' * 1_000_000)")) == b"x" * 1_000_000 + b"\n"


@pytest.mark.parametrize("size", [OSError(), os.terminal_size((0, 0))])
def test_without_a_terminal_it_has_the_usual_size(
    monkeypatch: pytest.MonkeyPatch, size: OSError | os.terminal_size
) -> None:
    """Also where the launch's own says that it has none."""

    def get() -> os.terminal_size:
        if isinstance(size, OSError):
            raise size
        return size

    monkeypatch.setattr("os.get_terminal_size", get)
    with asyncio.Runner() as runner:
        assert runner.run(run(LOOK)).startswith(b"terminal True 80 24\n")
