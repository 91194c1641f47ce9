"""A role's side of its pipes: reports to the parent, waits for its start, notices its end."""

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
    """The parent process. Needs a running loop."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._go = asyncio.Event()
        self._gone = asyncio.Event()
        # A thread, because not every loop can watch a pipe; os.read, because a daemon thread that holds the
        # lock of sys.stdin would disturb the interpreter's end.
        threading.Thread(target=self._read, name="stdin", daemon=True).start()

    def _read(self) -> None:
        received = b""
        while chunk := os.read(sys.stdin.fileno(), 4096):
            received += chunk
            if b"go\n" in received:
                self._set(self._go)
        self._set(self._gone)

    def _set(self, event: asyncio.Event) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(event.set)

    async def ready(self) -> None:
        """Report that everything is set up, and wait for `go`."""
        report("ready")
        async with asyncio.timeout(GO_TIMEOUT_S):
            await self._go.wait()

    async def gone(self) -> None:
        """Wait until the parent closes stdin: the end of held roles, a failure of others."""
        await self._gone.wait()


class Load:
    """CPU and wall time of the load, from construction."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._cpu_s = time.process_time()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the load began."""
        return time.perf_counter() - self._began

    def figures(self, messages: int, **more: float) -> dict[str, float]:
        """Return the figures of every role and the additional ones of this role."""
        return {"cpu_s": time.process_time() - self._cpu_s, "messages": messages, **more}


def report(event: str, **figures: Any) -> None:
    """Report an event to the parent."""
    sys.stdout.write(json.dumps({"event": event, **figures}) + "\n")
    sys.stdout.flush()
