"""What comes on stdin, as it comes, without holding up the loop."""

from __future__ import annotations

import asyncio
import codecs
import os
import sys
from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

READ_BYTES: Final = 64 * 1024


async def pieces() -> AsyncGenerator[str]:
    """Yield text until stdin ends.

    Raises:
        CommandError: There is no stdin, or it is not UTF-8.
    """
    try:
        number = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        raise CommandError("There is nothing to read from: stdin is closed") from None
    decoder = codecs.getincrementaldecoder("utf-8")()
    data = b"."
    while data:
        await _readable(number)
        data = os.read(number, READ_BYTES)
        try:
            yield decoder.decode(data, final=not data)
        except UnicodeDecodeError as error:
            raise CommandError(f"What comes on stdin is not UTF-8: {error.reason}") from None


async def _readable(number: int) -> None:
    """Wait until reading does not block; of a file, or where the loop cannot tell, it just reads."""
    loop = asyncio.get_running_loop()
    ready = asyncio.Event()
    try:
        loop.add_reader(number, ready.set)
    except (PermissionError, NotImplementedError):
        await asyncio.sleep(0)  # for what else is to be done
        return
    try:
        await ready.wait()
    finally:
        loop.remove_reader(number)
