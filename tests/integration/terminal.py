"""A program on a pseudo terminal: read what it draws, and type keys."""

from __future__ import annotations

import asyncio
import fcntl
import os
import struct
import sys
import termios
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from tests.fork_server.client import FORKED
from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator


class Terminal:
    """A terminal of 100 columns and 30 rows, with a program on it.

    Attributes:
        process: The program.
        before: How the terminal was set before that.
    """

    def __init__(
        self, process: asyncio.subprocess.Process, before: list[Any], window: int, inside: int
    ) -> None:
        self.process = process
        self.before = before
        self._window = window
        self._inside = inside

    @property
    def settings(self) -> list[Any]:
        """The current settings of the terminal."""
        return termios.tcgetattr(self._inside)

    def type_keys(self, keys: bytes) -> None:
        """Write keys to the terminal."""
        os.write(self._window, keys)

    async def wait_for_exit(self) -> int:
        """Wait for the program's end; return its exit code."""
        async with asyncio.timeout(DEADLINE_SEC):
            return await self.process.wait()

    async def wait_for_text(self, wanted: str) -> None:
        """Read what the program draws until it contains `wanted`."""
        loop = asyncio.get_running_loop()
        drawn = b""
        more = asyncio.Event()
        loop.add_reader(self._window, more.set)
        try:
            async with asyncio.timeout(DEADLINE_SEC):
                while wanted.encode() not in drawn:
                    await more.wait()
                    more.clear()
                    with suppress(BlockingIOError):  # the loop may report once more what has been read
                        drawn += os.read(self._window, 65536)
        except TimeoutError:
            raise AssertionError(f"The terminal did not show {wanted!r}: {drawn!r}") from None
        finally:
            loop.remove_reader(self._window)


@asynccontextmanager
async def on_terminal(*arguments: str, term: str, **environment: str) -> AsyncGenerator[Terminal]:
    """Run `callboard` with these arguments on a terminal of its own, and kill it at the end.

    It gets this process's environment without NO_COLOR, and what else is given.
    """
    window, inside = os.openpty()
    try:
        os.set_blocking(window, False)
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        before = termios.tcgetattr(inside)
        environ = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "actors", *arguments),
            executable=FORKED,
            cwd=ROOT,
            env=environ | {"TERM": term} | environment,
            stdin=inside,
            stdout=inside,
            stderr=inside,
        )
        try:
            yield Terminal(process, before, window, inside)
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
    finally:
        os.close(window)
        os.close(inside)
