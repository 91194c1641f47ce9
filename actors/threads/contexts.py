"""Asynchronous context managers that are entered and left on request, each in a task of its own.

A node cancels the task that entered it when it fails, so that task must exist as long as the node.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager


class Contexts:
    """Enters contexts, and leaves them in reverse order.

    Args:
        failed: Called with the error of a context that ends by itself.
    """

    def __init__(self, failed: Callable[[BaseException], None]) -> None:
        self._failed = failed
        self._held: list[HeldContext] = []

    async def enter(
        self, context: AbstractAsyncContextManager[Any], began: Callable[[HeldContext], object]
    ) -> Any:
        """Enter a context; return its value, or raise its error. Call `began` as it begins."""
        # A task of its own, because asyncio ties a node to the task that entered it: its failure cancels
        # that task, and timeouts inside belong to it. The task of `call` ends as soon as the value is
        # returned.
        held = HeldContext(context)
        # Before the first await. The caller may time out at any time after it, and must know what to leave.
        began(held)
        self._held.append(held)
        held.task.add_done_callback(lambda _: self._ended(held))
        return await held.enter()

    async def leave(self, value: object) -> None:
        """Leave a context, given as such or by its value; raise its error.

        Raises:
            LookupError: It is not entered here.
        """
        for held in self._held:
            if value is held.context or value is held.value:
                await held.leave()
                return
        raise LookupError(f"{value!r} has not been entered in this thread")

    def leave_soon(self, value: object) -> None:
        """Leave a context if it is entered; an error of its end is one of the thread."""
        for held in self._held:
            if value is held.context or value is held.value:
                held.leave_soon()

    async def leave_all(self) -> None:
        """Leave all contexts."""
        while self._held:
            # In reverse order, as nested `async with` would: the broker was entered before the nodes that
            # use it.
            held = self._held[-1]
            try:
                await held.leave()
            except Exception as error:  # noqa: BLE001 - raised where the thread is stopped
                self._failed(error)

    def _ended(self, held: HeldContext) -> None:
        self._held.remove(held)
        # An error while it is entered or left belongs to the caller, who waits for it. Only one in between
        # has nobody else to tell.
        error = None if held.task.cancelled() else held.task.exception()
        if error is not None and held.entered.done() and not held.leaving:
            self._failed(error)


class HeldContext:
    """A context, and the task that enters and leaves it.

    Args:
        context: The context.

    Attributes:
        context: The context, which `leave` looks for.
        value: Its value, once entered.
        entered: Done once it is entered.
        task: The task.
        leaving: Whether it is being left on request.
    """

    def __init__(self, context: AbstractAsyncContextManager[Any]) -> None:
        self.context = context
        self.value: Any = None
        self.leaving = False
        loop = asyncio.get_running_loop()
        self.entered: asyncio.Future[None] = loop.create_future()
        self._leave = asyncio.Event()
        self.task = loop.create_task(self._hold())

    async def _hold(self) -> None:
        async with self.context as self.value:
            self.entered.set_result(None)
            await self._leave.wait()

    async def enter(self) -> Any:
        """Return the value when it is entered. If cancelled, end when it is left."""
        try:
            await asyncio.wait({self.entered, self.task}, return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            # Cancelling the waiter is not enough: the task would hold a node that nobody knows of.
            self.task.cancel()
            await asyncio.wait({self.task})
            raise
        if not self.entered.done():
            self.task.result()
        return self.value

    def leave_soon(self) -> None:
        """Leave it, without waiting."""
        self._leave.set()

    async def leave(self) -> None:
        """Leave it; raise its error."""
        self.leaving = True
        self._leave.set()
        # `wait` instead of `await self.task`: a cancellation of the caller then does not cut short the
        # node's stop.
        await asyncio.wait({self.task})
        if not self.task.cancelled():
            self.task.result()
