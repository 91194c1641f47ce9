"""Waits for conditions that are checked again after each change."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class ChangeSignal:
    """Wakes all waiting tasks, so that each checks its own condition again."""

    def __init__(self) -> None:
        self._waiters: dict[asyncio.Event, None] = {}

    def notify(self) -> None:
        """Report a change."""
        for waiter in self._waiters:
            waiter.set()

    async def wait_for(self, check: Callable[[], T | None]) -> T:
        """Return the first result of `check` that is not None: now, or after a change.

        The caller sets the deadline, with `asyncio.timeout`.
        """
        changed = asyncio.Event()
        self._waiters[changed] = None
        try:
            while (result := check()) is None:
                changed.clear()
                await changed.wait()
            return result
        finally:
            del self._waiters[changed]
