"""An event loop that records the connection attempts of its process."""

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
    """The loop that `actors.run` uses, with a record of connection attempts.

    Attributes:
        attempts: Times of the calls of `create_connection`, by `time.monotonic`.
    """

    def __init__(self) -> None:
        super().__init__()
        self.attempts: list[float] = []

    async def create_connection(self, *args: Any, **options: Any) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Record the time, and connect."""
        self.attempts.append(time.monotonic())
        return await super().create_connection(*args, **options)


def counting_loop() -> asyncio.AbstractEventLoop:
    """Return a new loop that records attempts."""
    return CountingLoop()


def taken_attempts() -> list[float]:
    """Return the attempts that the running loop has recorded since the last call."""
    loop = asyncio.get_running_loop()
    attempts: list[float] = getattr(loop, "attempts", [])
    taken = attempts[:]
    attempts.clear()
    return taken
