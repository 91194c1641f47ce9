"""A callback task: a coroutine callback that runs in the mailbox and releases it while it waits for a call.

Calls find their callback task through a context variable, which child tasks inherit.
"""

from __future__ import annotations

import asyncio
from contextvars import ContextVar, copy_context
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.functions import ENDS_PROGRAM

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator

    from actors.callbacks.mailbox import Mailbox
    from actors.callbacks.timing import CallbackTiming

current_callback_task: Final[ContextVar[CallbackTask | None]] = ContextVar(
    "callboard_callback_task", default=None
)


class CallbackTask:
    """One coroutine callback, from its start in the mailbox to its end.

    It runs in a copy of the context in which it is created, whatever asyncio task runs it.

    Args:
        mailbox: The mailbox of the node.
        coroutine: What the callback returned.
        ended: Called with the result, or with the exception that the callback raised.
        timing: Counts the duration of each step.
        concurrent: Run whether or not the mailbox is free (`concurrent=True`).
    """

    __slots__ = (
        "_calls",
        "_cancelled",
        "_context",
        "_coroutine",
        "_ended",
        "_mailbox",
        "_suspended",
        "_task",
        "_timing",
        "concurrent",
        "holding",
    )

    def __init__(
        self,
        mailbox: Mailbox,
        coroutine: Coroutine[Any, Any, Any],
        ended: Callable[[Any, BaseException | None], None],
        *,
        timing: CallbackTiming,
        concurrent: bool = False,
    ) -> None:
        self._mailbox = mailbox
        self._coroutine = coroutine
        self._ended = ended
        self._timing = timing
        self.concurrent = concurrent
        self._context = copy_context()
        self._context.run(current_callback_task.set, self)
        self._calls = 0
        self._suspended = False
        self._cancelled = False
        self._task: asyncio.Task[Any] | None = None
        self.holding = False

    def call_started(self) -> None:
        """Count a callboard call of this callback that is in flight now."""
        self._calls += 1
        if self._suspended:
            self._release()

    def call_ended(self) -> None:
        """Count such a call as ended."""
        self._calls -= 1

    def cancel(self) -> None:
        """Cancel the callback; its coroutine sees CancelledError."""
        if not self._cancelled:
            self._cancelled = True
            if self._task is not None:
                self._task.cancel()

    @property
    def task(self) -> asyncio.Task[Any] | None:
        """The asyncio task that runs it; None before and after."""
        return self._task

    @property
    def name(self) -> str:
        """The callback's name, for messages."""
        return getattr(self._coroutine, "__qualname__", None) or repr(self._coroutine)

    @property
    def cancelled(self) -> bool:
        """Whether `cancel` was called: without it, CancelledError is an error of the callback."""
        return self._cancelled

    def discard(self) -> None:
        """Close the coroutine without running it."""
        self._cancelled = True
        self._coroutine.close()
        self._mailbox.task_ended(self)

    def _release(self) -> None:
        if self.holding:
            self.holding = False
            self._mailbox.release()

    async def run(self) -> None:
        """Run the callback to its end in the current task."""
        task = self._task = asyncio.current_task()
        assert task is not None
        result: Any = None
        failure: BaseException | None = None
        try:
            if self._cancelled:
                self._coroutine.close()
                raise asyncio.CancelledError
            result = await self
        except asyncio.CancelledError as error:
            if task.cancelling() and self._mailbox.closed:
                raise
            # Otherwise the callback or something that it awaited was cancelled, or the callback cancelled its
            # own asyncio task: each ends the callback, not the worker.
            failure = error
        except SystemExit as error:
            if not self._mailbox.exited(error):
                raise
            return
        except (*ENDS_PROGRAM, GeneratorExit):  # the last: the loop has closed under this task
            raise
        except BaseException as error:  # noqa: BLE001 - the owner of the callback decides what an error means
            failure = error
        finally:
            self._task = None
            del self._context  # it refers to this object: no work for the garbage collector
            self._mailbox.task_ended(self)
        while task.cancelling() and not self._mailbox.closed:
            task.uncancel()
        self._ended(result, failure)

    def __await__(self) -> Generator[Any, Any, Any]:
        """Drive the coroutine, and release the mailbox at each suspension with a call in flight."""
        error: BaseException | None = None
        value: Any = None
        timing, budget, run = self._timing, self._mailbox.budget, self._context.run
        clock = budget.clock
        first = began = clock()
        # The mailbox itself starts concurrent callback tasks in order and within the budget.
        if budget.exhausted and not self.concurrent:
            error = yield from self._before_step(error)
            began = clock()
        while True:
            try:
                if error is None:
                    waiting = run(self._coroutine.send, value)
                else:
                    waiting = run(self._coroutine.throw, error)
            except StopIteration as stop:
                return stop.value
            finally:
                now = clock()
                timing.stepped(now - began, now - first)
                budget.spend_step(now - began)
            self._suspended = True
            if self._calls:
                self._release()
            value = error = None
            try:
                value = yield waiting
            except GeneratorExit:  # abandoned: nobody runs this any more
                self._coroutine.close()
                raise
            except BaseException as thrown:  # noqa: BLE001 - handed on to the coroutine unchanged
                error = thrown
            self._suspended = False
            if budget.exhausted or not (self.holding or self.concurrent):
                error = yield from self._before_step(error)
            began = clock()

    def _before_step(self, error: BaseException | None) -> Generator[Any, Any, BaseException | None]:
        """Wait for the mailbox and the callback budget; return what to throw into the coroutine.

        A cancelled callback, too, waits for the mailbox, so that it never runs at the same time as another.
        As in any task, the cancellation replaces the result of what was awaited.
        """
        mailbox = self._mailbox
        while not mailbox.closed:
            try:
                if not (self.holding or self.concurrent):
                    yield from mailbox.take(self).__await__()
                elif mailbox.budget.exhausted:
                    yield from mailbox.budget.wait().__await__()
                else:
                    break
            except asyncio.CancelledError as thrown:
                error = thrown
        return error
