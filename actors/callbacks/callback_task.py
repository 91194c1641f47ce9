"""A callback task: a coroutine callback that runs in the mailbox and releases it while it waits for a call.

Calls find their callback task through a context variable, which child tasks inherit.
"""

from __future__ import annotations

import asyncio
from contextvars import ContextVar, copy_context
from types import coroutine as generator_coroutine
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator

    from actors.callbacks.budget import CallbackBudget
    from actors.callbacks.timing import CallbackTiming

current_callback_task: Final[ContextVar[CallbackTask | None]] = ContextVar(
    "callboard_callback_task", default=None
)

Step: TypeAlias = "tuple[Callable[[Any], Any], Any]"
"""A coroutine's `send` or `throw`, and its argument."""


class CallbackRunner(Protocol):
    """The part of a mailbox that callback tasks use, to get their turn among the node's callbacks.

    Attributes:
        budget: How long callbacks may run in this loop turn.
    """

    budget: CallbackBudget

    @property
    def closed(self) -> bool:
        """Whether nothing more runs: a callback that waits for its turn ends."""
        ...

    async def acquire(self, callback_task: CallbackTask) -> None:
        """Wait until no other callback runs, and set `holding`."""
        ...

    def release(self) -> None:
        """Let other callbacks run, as this one waits for a call."""
        ...

    def task_ended(self, callback_task: CallbackTask) -> None:
        """Forget a callback task that has ended or was discarded."""
        ...

    def exited(self, error: SystemExit) -> bool:
        """Handle SystemExit of a callback; return whether it ends the node only, not the program."""
        ...


class CallbackTask:
    """One coroutine callback, from its start in the mailbox to its end.

    It runs in a copy of the context in which it is created, whatever asyncio task runs it.

    Args:
        mailbox: The mailbox of the node.
        coroutine: The coroutine that the callback returned.
        ended: Called with the result, or with the exception that the callback raised.
        timing: Counts the duration of each step.

    Attributes:
        holding: Whether it holds the mailbox; set by the mailbox.
        concurrent: Whether it runs without holding the mailbox; set by the mailbox.
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
        mailbox: CallbackRunner,
        coroutine: Coroutine[Any, Any, Any],
        ended: Callable[[Any, BaseException | None], None],
        timing: CallbackTiming,
    ) -> None:
        self._mailbox = mailbox
        self._coroutine = coroutine
        self._ended = ended
        self._timing = timing
        self._context = copy_context()
        self._context.run(current_callback_task.set, self)
        # Calls in flight: of the callback itself and of the tasks that it has started, which inherit the
        # context.
        self._calls = 0
        self._suspended = False
        self._cancelled = False
        self._task: asyncio.Task[Any] | None = None
        self.holding = self.concurrent = False

    def call_started(self) -> None:
        """Count a callboard call of this callback that is in flight now."""
        self._calls += 1
        # The call belongs to a task that the callback started, and the callback is suspended already. At
        # that time there was no call, so it has kept the mailbox until now.
        if self._suspended:
            self._release()

    def call_ended(self) -> None:
        """Count such a call as ended."""
        self._calls -= 1

    def cancel(self) -> None:
        """Cancel the callback; its coroutine sees CancelledError."""
        # Once only: a second cancellation would interrupt the cleanup that the first has started.
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
        # An unstarted coroutine that is dropped without `close` warns that it was never awaited.
        self._coroutine.close()
        self._mailbox.task_ended(self)

    def _release(self) -> None:
        # Not holding: it is concurrent, or has released the mailbox already. Releasing twice would let two
        # callbacks run at the same time.
        if self.holding:
            self.holding = False
            self._mailbox.release()

    @generator_coroutine
    def run(self, task: asyncio.Task[Any]) -> Generator[Any, Any, None]:
        """Run the callback to its end in `task`, which must be the current task."""
        # The coroutine is driven by hand instead of awaited: only so can each step run in the callback's
        # own context, be timed, and be put off until the mailbox and the budget allow it.
        self._task = task
        mailbox, timing, run = self._mailbox, self._timing, self._context.run
        budget, clock = mailbox.budget, mailbox.budget.clock
        result: Any = None
        failure: BaseException | None = None
        step, argument = self._coroutine.send, None
        try:
            if self._cancelled:
                # It was cancelled before its first step: as with a task, its code never runs.
                self._coroutine.close()
                raise asyncio.CancelledError
            first = began = clock()
            # The mailbox itself starts concurrent callback tasks in order and within the budget.
            if budget.exhausted and not self.concurrent:
                step, argument = yield from self._before_step(step, argument)
                began = clock()
            while True:
                try:
                    awaited = run(step, argument)
                except StopIteration as stop:
                    result = stop.value
                    break
                finally:
                    now = clock()
                    timing.stepped(seconds := now - began, now - first)
                    budget.spend_step(seconds)
                step, argument = yield from self._suspend(awaited)
                began = clock()
        except BaseException as error:
            if self._ends_worker(error):
                raise
            # An error of the callback: `ended` reports it, and the worker goes on to the next callback.
            failure = error
        finally:
            self._task, ended = None, self._ended
            del self._context, self._ended  # they refer to this object: no work for the garbage collector
            mailbox.task_ended(self)
        # The worker outlives this callback. A cancellation that was meant for it must not count against the
        # next one, where `asyncio.timeout` and TaskGroup would take it for theirs. A closed mailbox has no
        # next callback: the node itself cancels the worker then.
        while task.cancelling() and not mailbox.closed:
            task.uncancel()
        if not isinstance(failure, SystemExit):  # which has ended the node
            ended(result, failure)

    def _ends_worker(self, error: BaseException) -> bool:
        """Return whether an exception ends the task that runs the callback, too."""
        mailbox, task = self._mailbox, self._task
        if isinstance(error, asyncio.CancelledError):
            # Otherwise the callback or something that it awaited was cancelled, or the callback cancelled its
            # own asyncio task: each ends the callback, not the worker.
            return mailbox.closed and task is not None and task.cancelling() > 0
        if isinstance(error, SystemExit):
            return not mailbox.exited(error)
        return isinstance(error, KeyboardInterrupt | GeneratorExit)  # the last: the loop has closed

    def _suspend(self, awaited: Any) -> Generator[Any, Any, Step]:
        """Wait for what a step awaits, without the mailbox if a call is in flight; return the next step."""
        self._suspended = True
        # Without a call in flight (a sleep, a file, a lock) the mailbox stays held. Users rely on it:
        # between two awaits of that kind no other (not concurrent) callback of the node runs.
        if self._calls:
            self._release()
        step, argument = self._coroutine.send, None
        try:
            argument = yield awaited
        except GeneratorExit:  # abandoned: nobody runs this any more
            self._coroutine.close()
            raise
        except BaseException as thrown:  # noqa: BLE001 - handed on to the coroutine unchanged
            step, argument = self._coroutine.throw, thrown
        self._suspended = False
        if self._mailbox.budget.exhausted or not (self.holding or self.concurrent):
            return (yield from self._before_step(step, argument))
        return step, argument

    def _before_step(self, step: Callable[[Any], Any], argument: Any) -> Generator[Any, Any, Step]:
        """Wait for the mailbox and the callback budget; return the step, or the throwing of a cancellation.

        A cancelled callback, too, waits for the mailbox, so that it never runs at the same time as another.
        As in any task, the cancellation replaces the result of what was awaited.
        """
        mailbox = self._mailbox
        # In a loop, because each wait can undo the other's result: while it waits for the budget another
        # callback may run, and when it gets the mailbox the budget may be used up.
        while not mailbox.closed:
            try:
                if not (self.holding or self.concurrent):
                    yield from mailbox.acquire(self).__await__()
                elif mailbox.budget.exhausted:
                    yield from mailbox.budget.wait().__await__()
                else:
                    break
            except asyncio.CancelledError as thrown:
                step, argument = self._coroutine.throw, thrown
        return step, argument
