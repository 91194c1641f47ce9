"""Read documents from stdin as they arrive, without blocking the event loop."""

from __future__ import annotations

import asyncio
import codecs
import os
import sys
from contextlib import aclosing
from typing import TYPE_CHECKING, Final, TypeVar

from actors.cli.documents import Documents
from actors.cli.errors import CommandError
from actors.cli.output import print_err

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

T = TypeVar("T")
READ_BYTES: Final = 64 * 1024


async def documents(read: Callable[[str], T]) -> AsyncGenerator[T]:
    """Yield the result of `read` for each document on stdin, as soon as it is complete; see `documents.py`.

    Raises:
        CommandError: stdin is not text, or `read` raised it; the text then has the document's number.
    """
    if sys.stdin is not None and sys.stdin.isatty():
        print_err("Write YAML, and --- in a line of its own after each message; Ctrl-D ends")
    found, number = Documents(), 0
    async with aclosing(pieces()) as coming:
        async for piece in coming:
            try:
                texts = found.feed(piece) if piece else []
            except ValueError as error:
                raise CommandError(str(error)) from None
            for text in texts:
                number += 1
                yield _read_document(read, text, number)
    for text in found.end():
        yield _read_document(read, text, number + 1)


def _read_document(read: Callable[[str], T], text: str, number: int) -> T:
    try:
        return read(text)
    except CommandError as error:
        raise CommandError(f"Message {number} on stdin: {error}") from None


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
    """Wait until reading does not block; return at once for files, which the loop cannot watch."""
    loop = asyncio.get_running_loop()
    ready = asyncio.Event()
    try:
        loop.add_reader(number, ready.set)
    except (PermissionError, NotImplementedError):
        await asyncio.sleep(0)  # lets other tasks run
        return
    try:
        await ready.wait()
    finally:
        loop.remove_reader(number)
