"""One callback at a time: the mailbox that a node's callbacks run through.

A *source* (subscription, service, timer) posts itself when it has something to run. While the mailbox is
free, plain functions run at once, where the message arrives: no task, no await, no wake-up. A coroutine runs
as a *callback task* in a worker; the mailbox stays taken until it ends.

Callbacks run as far as the loop's callback budget goes (`budget.py`). A source that has used its
share goes to the end of the mailbox's queue, and a mailbox that finds the budget exhausted continues in a
later loop turn.

Each callback runs in a context (`contextvars`) of its own, a copy of the one in which the node was entered.
Plain callbacks share one copy for as long as none of them changes it, because comparing an unchanged copy
with its original costs a fraction of making another and calling through it.

There is one point of interleaving. A callback task that is suspended while a callboard call of its own is in
flight (a service call, a wait for a peer) releases the mailbox and acquires it again before it continues.
So a callback may call any service, including those of its own node, in circles, through `gather` or in tasks
it starts, and nothing can deadlock.

Sources with `concurrent=True` do not wait for a taken mailbox: their plain functions run while the callback
task that holds it is suspended, and their callback tasks run without it.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextvars import copy_context
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.budget import BUDGET_SEC, SHARE_SEC, CallbackBudget
from actors.callbacks.callback_task import current_callback_task
from actors.callbacks.functions import ENDS_PROGRAM
from actors.callbacks.source import Share, changed

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.callbacks.callback_future import LateCallback
    from actors.callbacks.callback_task import CallbackTask
    from actors.callbacks.source import CallbackSource

IDLE_WORKERS: Final = 16
"""Workers kept for the next callback tasks; further ones end as soon as they have nothing to do."""

CONCURRENT_STARTS: Final = 16
"""Callback tasks of `concurrent=True` sources that start in one loop turn while steps are short."""

SHORT_STEP_SEC: Final = BUDGET_SEC / CONCURRENT_STARTS
"""A step shorter than this is short. While steps are longer, concurrent callback tasks start one by one."""


class Mailbox:
    """Runs the callbacks of one node, one at a time.

    Bounded: the queue holds each source once; there are as many workers as callback tasks at the same time,
    and a few idle ones. The sources limit the number of callback tasks.

    Attributes:
        workers: Asyncio tasks that run callback tasks, or wait for one.
        running: The callbacks that have begun, or are about to: callback tasks, and those with a future.
        budget: The callback budget of the loop that the node runs on; set by `open`.
        cancelling: Whether all callback tasks are cancelled, so that CancelledError in them is no error.
        on_exit: Called with a callback's SystemExit, after which no callback begins. With None, it ends the
            program.
    """

    def __init__(self) -> None:
        self.workers = 0
        self.running: dict[CallbackTask | LateCallback, None] = {}
        self.cancelling = False
        self.on_exit: Callable[[SystemExit], None] | None = None
        self._on_drained: Callable[[], None] | None = None
        """Set by `drain`: called when the last callback task ends."""
        # Sources with work, first come, first served. Each is in it once (`source.posted`), however much it
        # has to do; that bounds the queue by the number of endpoints.
        self._ready: deque[CallbackSource] = deque()
        # Callback tasks that wait to hold the mailbox again. Made when needed: most nodes never have any,
        # and there may be thousands of nodes in a process.
        self._resuming: deque[tuple[CallbackTask, asyncio.Future[None]]] | None = None
        self._assigned: list[CallbackTask] = []  # at most one: it holds the mailbox
        self._not_begun: dict[CallbackTask, None] = {}
        """Concurrent callback tasks that have not begun yet, oldest first."""
        self._to_start: deque[CallbackTask] | None = None
        """The tasks of `_not_begun` that have no asyncio task yet."""
        self._start_deferred = False
        """Whether they wait for the callback budget."""
        # Starting an asyncio task takes longer than waking one, so workers wait here for the next callback
        # task.
        self._idle: list[asyncio.Future[None]] = []
        # `_busy`: a callback task holds the mailbox. `_running_ready`: `_run_ready` is on the stack.
        # `_returning`: a worker that has just finished is about to look for its next callback task.
        self._busy = self._running_ready = self._returning = False
        self._deferred = False
        """Whether the mailbox waits for the callback budget."""
        self.budget: CallbackBudget
        self._share: Share
        self._spawn: Callable[[Coroutine[Any, Any, None]], object] | None = None

    def open(self, spawn: Callable[[Coroutine[Any, Any, None]], object], budget: CallbackBudget) -> None:
        """Start to run callbacks, in copies of the current context.

        Args:
            spawn: Starts a task that its owner awaits or cancels.
            budget: The callback budget of the running loop.
        """
        self._spawn = spawn
        self.budget = budget
        original = copy_context()
        # Callbacks of a node that is entered in a callback do not belong to that callback.
        original.run(current_callback_task.set, None)
        self._share = Share(budget.clock, original)
        self._run_ready()

    def drain(self, on_drained: Callable[[], None]) -> None:
        """Let the callback tasks that have begun run to their ends, and begin no others.

        Args:
            on_drained: Called when the last one has ended.
        """
        self._on_drained = on_drained
        # Their messages stay in the queues of the sources, where they are counted as unread.
        self._ready.clear()

    def exited(self, error: SystemExit) -> bool:
        """Handle SystemExit of a callback; return whether it ends the node only, not the program."""
        if self.on_exit is None:
            return False
        self.drain(lambda: None)
        self.on_exit(error)
        return True

    def end_program(self, error: BaseException) -> None:
        """End the node or the program with SystemExit or KeyboardInterrupt of a plain callback.

        The loop raises it in its next turn: uvloop ignores what is raised where data is received.
        """
        if not (isinstance(error, SystemExit) and self.exited(error)):
            self.drain(lambda: None)
            asyncio.get_running_loop().call_soon(_raise, error)

    def cancel_all(self) -> None:
        """Cancel every callback task."""
        self.cancelling = True
        for callback_task in tuple(self.running):
            callback_task.cancel()

    def task_ended(self, callback_task: CallbackTask | LateCallback) -> None:
        """Forget a callback task that has ended or was discarded."""
        self.running.pop(callback_task, None)
        if self._on_drained is not None and not self.running:
            self._on_drained()

    def close(self) -> None:
        """Run nothing more. The owner of `spawn` ends the tasks that still run."""
        self._spawn = None
        self._ready.clear()
        while self._assigned:
            # It has a worker, which has not come to run yet and will find nothing.
            self._assigned.pop().discard()
        self._to_start = None
        while self._not_begun:
            self._not_begun.popitem()[0].discard()

    @property
    def closed(self) -> bool:
        """Whether it runs nothing: not opened yet, or closed."""
        return self._spawn is None

    @property
    def busy(self) -> bool:
        """Whether a coroutine callback holds it."""
        return self._busy

    @property
    def waiting(self) -> int:
        """Sources whose callbacks wait."""
        return len(self._ready)

    @property
    def idle_workers(self) -> int:
        """Workers that wait for a callback task."""
        return len(self._idle)

    @property
    def suspended(self) -> int:
        """Callback tasks that have released the mailbox and wait for a call, or for the mailbox."""
        return max(0, self.workers - len(self._idle) - self._busy)

    @property
    def free(self) -> bool:
        """Whether a callback posted now would run at once."""
        waits = self._busy or self._running_ready or self._ready
        return self._spawn is not None and not waits and not self.budget.exhausted

    def post(self, source: CallbackSource) -> None:
        """Run the source's callbacks as soon as the mailbox is free: now, if it is.

        Those of a concurrent source do not wait for a coroutine callback that is suspended.
        """
        if not source.posted and self._on_drained is None:
            source.posted = True
            self._ready.append(source)
            if not self._busy or source.concurrent:
                self._run_ready()

    def _run_ready(self) -> None:
        """Run what waits, until out of budget; while the mailbox is taken, concurrent sources only."""
        # A callback that posts (it publishes to its own node, for example) only adds to the queue: the
        # outer call goes on with it. Recursion would let it run in the middle of the callback that caused
        # it.
        if self._running_ready:
            return
        self._running_ready = True
        ready = self._ready
        try:
            while self._spawn is not None:
                # While a callback task holds the mailbox only concurrent sources may run, wherever they are
                # in the queue.
                if self._busy:
                    source = next((each for each in ready if each.concurrent), None)
                # Before new callbacks begin. Otherwise a busy subscription would start callbacks faster
                # than they finish, and each unfinished one holds its message and its locals.
                elif self._resuming:
                    self._resume(*self._resuming.popleft())
                    continue
                else:
                    source = ready[0] if ready else None
                if source is None:
                    return
                # Not checked for resumed callback tasks: they check it themselves before each step.
                if self.budget.exhausted:
                    self._defer()
                    return
                ready.remove(source)
                # Before the dispatch: a message that arrives during it posts the source again.
                source.posted = False
                callback_task = self._dispatch(source)
                if callback_task is not None:
                    self._busy = True
                    self._assign(callback_task)
                # Its share is used. It goes to the end, so that every other source runs once before it
                # continues.
                if source.has_work() and not source.posted and self._on_drained is None:
                    source.posted = True
                    self._ready.append(source)
        finally:
            self._running_ready = False

    def _resume(self, callback_task: CallbackTask, waiter: asyncio.Future[None]) -> None:
        # Cancelled meanwhile: then it does not take the mailbox, and the next one in the queue gets it.
        if not waiter.done():
            self._busy = callback_task.holding = True
            waiter.set_result(None)

    def _defer(self) -> None:
        """Continue in a later loop turn."""
        if not self._deferred:
            self._deferred = True
            self.budget.continue_later(self._continue)

    def _continue(self) -> None:
        self._deferred = False
        self._run_ready()

    def _dispatch(self, source: CallbackSource) -> CallbackTask | None:
        share, timing = self._share, source.timing
        clock, context = share.clock, share.context
        began = clock()
        share.until = began + SHARE_SEC
        callback_task: CallbackTask | None = None
        try:
            # One context for the whole dispatch. If a callback changes it, the source returns
            # (`Share.used`), and the next dispatch gets a new copy.
            callback_task = context.run(source.dispatch, share)
        except ENDS_PROGRAM as error:
            self.end_program(error)
        finally:
            # Calling one `async def` takes no time worth measuring; its steps count.
            if callback_task is None or not timing.only_steps:
                seconds = clock() - began
                self.budget.spend(seconds)
                timing.dispatched(seconds, source.calls)
            # The next callback must not see a variable that this one has set.
            if changed(context, share.original):
                share.context = share.original.copy()
        return callback_task

    def _assign(self, callback_task: CallbackTask) -> None:
        callback_task.holding = True
        self.running[callback_task] = None
        self._assigned.append(callback_task)
        if self._returning:
            return
        while self._idle:
            waiter = self._idle.pop(0)
            if not waiter.done():
                waiter.set_result(None)
                return
        assert self._spawn is not None
        self.workers += 1
        self._spawn(self._work())

    async def _work(self) -> None:
        """Run callback tasks until closed. A few idle workers wait for the next one."""
        try:
            await self._work_on()
        finally:
            self.workers -= 1

    async def _work_on(self) -> None:
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        assert task is not None
        while True:
            while self._assigned:
                callback_task = self._assigned.pop()
                await callback_task.run(task)
                # Not holding: the mailbox was closed while it waited to hold it again.
                if callback_task.holding:
                    callback_task.holding = False
                    self._busy = False
                    # This worker runs what the mailbox assigns now, so no other is woken for it.
                    self._returning = True
                    self._run_ready()
                    self._returning = False
            # Closed meanwhile (which may have cancelled the callback task), or not needed.
            if self._spawn is None or len(self._idle) >= IDLE_WORKERS:
                return
            waiter: asyncio.Future[None] = loop.create_future()
            self._idle.append(waiter)
            await waiter

    def run_concurrently(self, callback_task: CallbackTask) -> None:
        """Run a callback task of a `concurrent=True` source soon, even if the mailbox is taken.

        Such tasks start in order.
        """
        if self._spawn is None:
            callback_task.discard()
        else:
            callback_task.concurrent = True
            self.running[callback_task] = self._not_begun[callback_task] = None
            self._to_start = self._to_start or deque()
            self._to_start.append(callback_task)
            self._start_concurrent()

    def _start_concurrent(self) -> None:
        """Start concurrent callback tasks until as many as allowed wait for their first step."""
        budget, to_start = self.budget, self._to_start
        # The budget is only checked between steps. Sixteen tasks started at once take their first steps in
        # the same loop turn, whatever those take, so many start only if the last steps were short.
        most = CONCURRENT_STARTS if budget.step_sec < SHORT_STEP_SEC else 1
        while to_start and len(self._not_begun) - len(to_start) < most and self._spawn is not None:
            # One entry in the budget's queue, not one for each task: the others start behind the first.
            if budget.exhausted:
                if not self._start_deferred:
                    self._start_deferred = True
                    budget.continue_later(self._continue_starting)
                return
            self._spawn(self._run_concurrent(to_start.popleft()))

    def _continue_starting(self) -> None:
        self._start_deferred = False
        self._start_concurrent()

    async def _run_concurrent(self, callback_task: CallbackTask) -> None:
        self._not_begun.pop(callback_task, None)
        # All that were started have begun. `call_soon` puts the next ones behind these first steps, whose
        # duration then decides how many start.
        if self._to_start and len(self._not_begun) == len(self._to_start):
            asyncio.get_running_loop().call_soon(self._start_concurrent)
        task = asyncio.current_task()
        assert task is not None
        await callback_task.run(task)

    def release(self) -> None:
        """Free the mailbox and run what waits for it."""
        self._busy = False
        self._run_ready()

    async def acquire(self, callback_task: CallbackTask) -> None:
        """Wait until the callback task holds the mailbox again."""
        # Not past others that wait: order among resuming callbacks is first come, first served.
        if not self._busy and not self._running_ready and not self._resuming:
            self._busy = callback_task.holding = True
            return
        waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._resuming = self._resuming or deque()
        self._resuming.append((callback_task, waiter))
        await waiter


def _raise(error: BaseException) -> None:
    raise error
