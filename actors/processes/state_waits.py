"""Waits for states of children, checked after every transition of the plan, so that no state is missed."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.processes.restart_plan import ChildState


class StateWaits:
    """The tasks that wait for a child to be in a state.

    Args:
        state_of: Returns a child's state by its index.
    """

    def __init__(self, state_of: Callable[[int], ChildState]) -> None:
        self._state_of = state_of
        self._waiting: dict[asyncio.Future[bool], tuple[int, ChildState]] = {}
        self._closed = False

    async def wait(self, child: int, state: ChildState) -> bool:
        """Wait for a state; return False if the supervisor ends before."""
        reached: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._waiting[reached] = (child, state)
        try:
            self.check()
            return await reached
        finally:
            self._waiting.pop(reached, None)

    def check(self) -> None:
        """Wake those whose state has been reached."""
        for reached, (child, state) in tuple(self._waiting.items()):
            if reached.done():
                continue
            if self._state_of(child) is state:
                reached.set_result(True)
            elif self._closed:
                reached.set_result(False)

    def close(self) -> None:
        """Wake all waiters: states will not change any more."""
        self._closed = True
        self.check()
