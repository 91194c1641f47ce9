"""The other end of a role's pipes: says ready, is told to go, notices when the parent lets go."""

from __future__ import annotations

import asyncio
import json
import os
import sys
import threading
import time
from typing import Any, Final

GO_TIMEOUT_S: Final = 120.0
"""From `ready` to `go`: the other roles start in between."""


class Parent:
    """Talks to the process that has started this one. Needs a running loop."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._go = asyncio.Event()
        self._gone = asyncio.Event()
        # A thread, because not every loop can watch a pipe; os.read, because a daemon thread that holds the
        # lock of sys.stdin would disturb the interpreter's end.
        threading.Thread(target=self._read, name="stdin", daemon=True).start()

    def _read(self) -> None:
        heard = b""
        while chunk := os.read(sys.stdin.fileno(), 4096):
            heard += chunk
            if b"go\n" in heard:
                self._tell(self._go)
        self._tell(self._gone)

    def _tell(self, event: asyncio.Event) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(event.set)

    async def told_to_go(self) -> None:
        """Say that everything is set up, and wait for `go`."""
        say("ready")
        async with asyncio.timeout(GO_TIMEOUT_S):
            await self._go.wait()

    async def gone(self) -> None:
        """Wait until the parent closes our stdin: the end of held roles, a reason to give up for others."""
        await self._gone.wait()


class Load:
    """CPU and wall time of the load alone: starts when it is made."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._cpu_s = time.process_time()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the load began."""
        return time.perf_counter() - self._began

    def figures(self, messages: int, **more: float) -> dict[str, float]:
        """Return what every role reports, and what this one has to add."""
        return {"cpu_s": time.process_time() - self._cpu_s, "messages": messages, **more}


def say(event: str, **figures: Any) -> None:
    """Tell the parent."""
    sys.stdout.write(json.dumps({"event": event, **figures}) + "\n")
    sys.stdout.flush()
