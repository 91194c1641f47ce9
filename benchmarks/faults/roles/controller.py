"""Pipes to the measuring process: write events, read commands, notice its end."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from typing import Final

from benchmarks.harness.roles.parent import report

CLOSED: Final = ""
"""Returned instead of a command when the measuring process has closed our stdin."""

__all__ = ["CLOSED", "Controller", "report"]


class Controller:
    """Read the commands of the measuring process. Needs a running loop."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._commands: asyncio.Queue[str] = asyncio.Queue()
        # A thread, because not every loop can watch a pipe; os.read, because a daemon thread that holds the
        # lock of sys.stdin would disturb the interpreter's end.
        threading.Thread(target=self._read, name="stdin", daemon=True).start()

    def _read(self) -> None:
        rest = b""
        while chunk := os.read(sys.stdin.fileno(), 4096):
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                self._received(line.decode())
        self._received(CLOSED)

    def _received(self, command: str) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._commands.put_nowait, command)

    async def next_command(self) -> str:
        """Wait for the next command; return CLOSED when stdin is closed."""
        return await self._commands.get()
