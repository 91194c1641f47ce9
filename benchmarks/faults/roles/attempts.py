"""An event loop that notes when its process tries to connect."""

from __future__ import annotations

import asyncio
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or find_spec("uvloop") is None:
    from asyncio import SelectorEventLoop as Loop
else:
    from uvloop import Loop


class CountingLoop(Loop):
    """The loop that `actors.run` takes, and a list.

    Attributes:
        attempts: When `create_connection` was called, by `time.monotonic`.
    """

    def __init__(self) -> None:
        super().__init__()
        self.attempts: list[float] = []

    async def create_connection(self, *args: Any, **options: Any) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Note the time, and connect."""
        self.attempts.append(time.monotonic())
        return await super().create_connection(*args, **options)


def counting_loop() -> asyncio.AbstractEventLoop:
    """Return a new loop that counts."""
    return CountingLoop()


def taken_attempts() -> list[float]:
    """Return the attempts noted by the running loop since the last call, and forget them."""
    loop = asyncio.get_running_loop()
    attempts: list[float] = getattr(loop, "attempts", [])
    taken = attempts[:]
    attempts.clear()
    return taken
