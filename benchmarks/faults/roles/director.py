"""The other end of a puppet's pipes: says events, hears words, and notices when the director is gone."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from typing import Final

from actors.bench.roles.parent import report

GONE: Final = ""
"""What is heard when the director has closed our stdin: time to go."""

__all__ = ["GONE", "Director", "report"]


class Director:
    """Hears what the measuring process tells this one. Needs a running loop."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._words: asyncio.Queue[str] = asyncio.Queue()
        # A thread, because not every loop can watch a pipe; os.read, because a daemon thread that holds the
        # lock of sys.stdin would disturb the interpreter's end.
        threading.Thread(target=self._read, name="stdin", daemon=True).start()

    def _read(self) -> None:
        rest = b""
        while chunk := os.read(sys.stdin.fileno(), 4096):
            *words, rest = (rest + chunk).split(b"\n")
            for word in words:
                self._heard(word.decode())
        self._heard(GONE)

    def _heard(self, word: str) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._words.put_nowait, word)

    async def word(self) -> str:
        """Wait for the next word; GONE when there will be none."""
        return await self._words.get()
