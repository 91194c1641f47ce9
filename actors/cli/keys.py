"""Keys that are pressed while a command runs, if it is in front of a terminal."""

from __future__ import annotations

import asyncio
import os
import re
import sys
from contextlib import aclosing, asynccontextmanager, contextmanager, suppress
from typing import TYPE_CHECKING, Final

from actors.cli.stdin import pieces
from proto.aio.tasks import cancel_and_wait, keep_running

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Awaitable, Callable, Generator


_KEY: Final = re.compile(r"\x1b\[[0-9;]*[@-~]|\x1bO.|.", re.DOTALL)
"""A key such as an arrow, which sends several characters, or any other."""


@asynccontextmanager
async def handling_keys(handle: Callable[[str], Awaitable[object]]) -> AsyncGenerator[None]:
    """Call a function with each key that is pressed, as `keys` yields it, until the context is left.

    Args:
        handle: Gets a key. What it raises is logged, and the next key is handled.
    """

    async def read() -> None:
        async with aclosing(keys()) as pressed:
            async for key in pressed:
                await handle(key)

    task = asyncio.create_task(keep_running("Reading keys", read))
    try:
        yield
    finally:
        await cancel_and_wait(task)


async def keys() -> AsyncGenerator[str]:
    """Yield each key as it is pressed, until the terminal is closed.

    End at once if stdin is no terminal, or another program has it.

    The terminal echoes nothing meanwhile and does not wait for the end of a line; it is as before when the
    generator is closed. Ctrl-C and others still send signals. A key that sends several characters, such as
    an arrow, is one text.
    """
    number = _terminal()
    if number is None:
        return
    with _unbuffered(number), suppress(OSError):  # its window has been closed
        async for text in pieces():
            # Keys that are held, or pressed while the program is busy, come as one text.
            for key in _KEY.findall(text):
                yield key


def _terminal() -> int | None:
    """Return the descriptor of stdin if it is a terminal that this process may read."""
    try:
        number = sys.stdin.fileno()
        if not os.isatty(number):
            return None
    except (AttributeError, OSError, ValueError):
        return None
    try:
        # In the background, reading would stop the process.
        return number if os.tcgetpgrp(number) == os.getpgrp() else None
    except OSError:  # another terminal than that of the session: nothing stops those who read it
        return number


@contextmanager
def _unbuffered(number: int) -> Generator[None]:
    import termios  # noqa: PLC0415 - Windows has none
    import tty  # noqa: PLC0415 - as termios

    before = termios.tcgetattr(number)
    try:
        tty.setcbreak(number, termios.TCSANOW)
        yield
    finally:
        with suppress(termios.error):
            termios.tcsetattr(number, termios.TCSANOW, before)
