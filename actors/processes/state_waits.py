"""Waits for a child to be in a state: looked at whenever the plan has moved, so that no state is missed."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.processes.restart_plan import ChildState


class StateWaits:
    """Everybody who waits for a state.

    Args:
        state_of: Gives a child's state by its index.
    """

    def __init__(self, state_of: Callable[[int], ChildState]) -> None:
        self._state_of = state_of
        self._waiting: dict[asyncio.Future[bool], tuple[int, ChildState]] = {}
        self._closed = False

    async def wait(self, child: int, state: ChildState, timeout_sec: float | None) -> bool:
        """Wait for a state; return whether it came before the time was over, and before the end."""
        came: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._waiting[came] = (child, state)
        try:
            self.look()
            async with asyncio.timeout(timeout_sec):
                return await came
        except TimeoutError:
            return False
        finally:
            self._waiting.pop(came, None)

    def look(self) -> None:
        """States may have changed."""
        for came, (child, state) in tuple(self._waiting.items()):
            if came.done():
                continue
            if self._state_of(child) is state:
                came.set_result(True)
            elif self._closed:
                came.set_result(False)

    def close(self) -> None:
        """States will not change any more."""
        self._closed = True
        self.look()
