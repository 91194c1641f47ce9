"""`callboard top` as a process of its own."""

from __future__ import annotations

import asyncio
import fcntl
import os
import re
import struct
import sys
import termios
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    from tests.integration.conftest import System


async def test_once_prints_what_goes_on(system: System) -> None:
    """A topic with its publisher; the exit code is 0."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.says("Publishing")
    top = await system.python("-m", "actors", "top", "--once", "--interval", "0.1")
    assert await top.ends() == 0
    assert re.search(r"^/addison +1 +0 .*std_msgs/msg/String$", top.output, re.MULTILINE)
    assert re.search(r"^/minimal_publisher +linked", top.output, re.MULTILINE)


async def test_the_program_in_the_guide_runs(system: System) -> None:
    """It prints each topic's rate."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.says("Publishing")
    text = (ROOT / "docs" / "how-to" / "top.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    run = await system.python("-c", program.replace("callboard://127.0.0.1:7411", system.url))
    assert await run.ends() == 0
    assert re.fullmatch(r"/addison \d+\.\d+", run.output)


@pytest.mark.parametrize("key", [b"q", b"\x03"], ids=["q", "ctrl-c"])
async def test_the_live_view_draws_and_quits(system: System, key: bytes) -> None:
    """In a terminal: q and Ctrl-C end it with 0, and the terminal is as it was."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.says("Publishing")
    terminal, inside = os.openpty()
    try:
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        before = termios.tcgetattr(inside)
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "actors", "top", "--url", system.url),
            env=os.environ | {"TERM": "xterm-256color"},
            stdin=inside,
            stdout=inside,
            stderr=inside,
        )
        try:
            await shows(terminal, b"/addison")
            os.write(terminal, key)
            await shows(terminal, b"\x1b[?1049l")
            async with asyncio.timeout(DEADLINE_SEC):
                assert await process.wait() == 0
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
        assert termios.tcgetattr(inside) == before
    finally:
        os.close(terminal)
        os.close(inside)


async def shows(terminal: int, wanted: bytes) -> None:
    """Read what is drawn until `wanted` is."""
    loop = asyncio.get_running_loop()
    drawn = b""
    more = asyncio.Event()
    loop.add_reader(terminal, more.set)
    try:
        async with asyncio.timeout(DEADLINE_SEC):
            while wanted not in drawn:
                await more.wait()
                more.clear()
                drawn += os.read(terminal, 65536)
    except TimeoutError:
        raise AssertionError(f"The screen did not show {wanted!r}: {drawn!r}") from None
    finally:
        loop.remove_reader(terminal)
