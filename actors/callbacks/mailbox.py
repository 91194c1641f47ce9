"""One callback at a time: the mailbox that a node's callbacks run through.

A *source* (subscription, service, timer) posts itself when it has something to run. While the mailbox is
free, plain functions run at once, where the message arrives: no task, no await, no wake-up. A coroutine runs
as a *turn* in a worker task; the mailbox stays taken until it ends.

Callbacks run as far as the loop's callback budget goes (`callback_budget.py`). A source that has used its
share goes to the end of the mailbox's queue, and a mailbox that finds the budget exhausted continues in a
later loop turn.

Each callback runs in a context (`contextvars`) of its own, a copy of the one in which the node was entered.
Plain callbacks share one copy for as long as none of them changes it, because comparing an unchanged copy
with its original costs a fraction of making another and calling through it.

There is one point of interleaving. A turn that is suspended while a callboard call of its own is in flight
(a service call, a wait for a peer) lets go of the mailbox, and takes it again before it goes on. So a
callback may call any service, its own node's too, in circles, through `gather` or in tasks it starts, and
nothing can deadlock.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextvars import Context, copy_context
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.callbacks.budget import BUDGET_SEC, SHARE_SEC, CallbackBudget
from actors.callbacks.callback_task import current_callback_task

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.callbacks.callback_task import CallbackTask
    from actors.callbacks.timing import CallbackTiming

IDLE_WORKERS: Final = 16
"""Workers kept for the next turns; more end as soon as they have nothing to do."""

BESIDE_STARTS: Final = 16
"""Turns of `concurrent=True` sources that start in one loop turn, as long as a step is short: ..."""

SHORT_STEP_SEC: Final = BUDGET_SEC / BESIDE_STARTS
"""... shorter than this. Otherwise they start one by one."""


class Source(Protocol):
    """Something with callbacks to run."""

    posted: bool
    """Whether it stands in the mailbox's queue; kept by the mailbox."""
    timing: CallbackTiming
    """How long its callback takes; kept by the mailbox and the turns."""
    calls: int
    """How often its callback has been called so far."""

    def dispatch(self, share: Share) -> CallbackTask | None:
        """Run queued callbacks until the share is used or one of them returns a coroutine.

        Args:
            share: Must be asked between two callbacks.

        Returns:
            The coroutine as a turn; None if there was none.
        """
        ...

    def has_work(self) -> bool:
        """Whether `dispatch` would run something now."""
        ...


class Share:
    """What a source may do in one dispatch.

    Attributes:
        clock: The budget's.
        until: The time on that clock after which the source must leave off.
        context: The context that the callbacks run in.
        original: What the context is a copy of. After a callback that has changed the context the source
            must leave off.
    """

    __slots__ = ("clock", "context", "original", "until")

    def __init__(self, clock: Callable[[], float], original: Context) -> None:
        self.clock = clock
        self.until = 0.0
        self.original = original
        self.context = original.copy()

    @property
    def used(self) -> bool:
        """Whether the source must leave off."""
        return self.clock() >= self.until or changed(self.context, self.original)


def changed(context: Context, original: Context) -> bool:
    """Tell whether a copy of a context has been changed.

    Cheap while it has not: then both are one object inside. Values that cannot be compared have changed.
    """
    try:
        return context != original
    except Exception:  # noqa: BLE001 - the __eq__ of a user's value; arrays have no truth value, for example
        return True


class Mailbox:
    """Runs the callbacks of one node, one at a time.

    Bounded: the queue holds each source once; there are as many workers as turns at the same time, and a few
    that wait for the next one. How many turns there may be is the sources' business.

    Attributes:
        workers: Tasks that run turns, or wait for one.
        running: The turns that have begun, or are about to.
        budget: The callback budget of the loop that the node runs on.
        cancelling: Whether all turns have been cancelled: their CancelledErrors are no errors of theirs.
        on_exit: Takes a callback's SystemExit, after which nothing new begins; None: it is raised where the
            callback runs, and ends the program.
    """

    def __init__(self) -> None:
        self.workers = 0
        self.running: dict[CallbackTask, None] = {}
        self.cancelling = False
        self.on_exit: Callable[[SystemExit], None] | None = None
        self._tell: Callable[[], None] | None = None
        """Set when nothing new is to begin; called as the last turn ends."""
        self._ready: deque[Source] = deque()
        self._resuming: deque[tuple[CallbackTask, asyncio.Future[None]]] = deque()
        self._given: deque[CallbackTask] = deque()
        self._beside: dict[CallbackTask, None] = {}
        """Turns whose task has not begun yet, oldest first."""
        self._to_start: deque[CallbackTask] = deque()
        """Those of them without a task."""
        self._start_deferred = False
        """Whether these wait for the callback budget."""
        self._idle: deque[asyncio.Future[None]] = deque()
        self._busy = False
        self._pumping = False
        self._returning = False
        self._deferred = False
        """Whether it waits for the callback budget."""
        self.budget = CallbackBudget()
        self._share = Share(self.budget.clock, Context())
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
        original.run(
            current_callback_task.set, None
        )  # callbacks of a node entered in a turn are no part of that
        self._share = Share(budget.clock, original)
        self._pump()

    def begin_nothing(self, tell: Callable[[], None]) -> None:
        """Let the turns that have begun go on to their ends, and begin no others.

        Args:
            tell: Called when the last one has ended.
        """
        self._tell = tell
        self._ready.clear()

    def exited(self, error: SystemExit) -> bool:
        """A callback wants the end of its program; return whether that is the node."""
        if self.on_exit is None:
            return False
        self.begin_nothing(_nothing)
        self.on_exit(error)
        return True

    def cancel_all(self) -> None:
        """Cancel every turn."""
        self.cancelling = True
        for callback_task in tuple(self.running):
            callback_task.cancel()

    def turn_ended(self, callback_task: CallbackTask) -> None:
        """A turn is over, whatever way."""
        self.running.pop(callback_task, None)
        if self._tell is not None and not self.running:
            self._tell()

    def close(self) -> None:
        """Run nothing more. Tasks that still run belong to the owner of `spawn`."""
        self._spawn = None
        self._ready.clear()
        while self._given:
            self._given.popleft().discard()
        self._to_start.clear()
        while self._beside:
            self._beside.popitem()[0].discard()

    @property
    def closed(self) -> bool:
        """Whether it runs nothing (any more)."""
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
        """Workers that wait for a turn."""
        return len(self._idle)

    @property
    def suspended(self) -> int:
        """Turns that have let go of the mailbox: they wait for a call, or to have the mailbox back."""
        return max(0, self.workers - len(self._idle) - self._busy)

    @property
    def free(self) -> bool:
        """Whether a callback posted now would run at once."""
        waits = self._busy or self._pumping or self._ready or self.budget.exhausted
        return not waits and self._spawn is not None

    def post(self, source: Source) -> None:
        """Run the source's callbacks as soon as the mailbox is free: now, if it is."""
        if not source.posted and self._tell is None:
            source.posted = True
            self._ready.append(source)
            self._pump()

    def _pump(self) -> None:
        if self._pumping:
            return
        self._pumping = True
        try:
            while not self._busy and self._spawn is not None:
                if self._resuming:
                    self._resume_next()
                    continue
                if not self._ready:
                    return
                if self.budget.exhausted:
                    self._defer()
                    return
                source = self._ready.popleft()
                source.posted = False
                try:
                    turn_or_none = self._dispatch(source)
                except SystemExit as error:
                    if not self.exited(error):
                        raise
                    return
                if turn_or_none is not None:
                    self._busy = True
                    self._give(turn_or_none)
                if source.has_work() and not source.posted and self._tell is None:
                    source.posted = True
                    self._ready.append(source)
        finally:
            self._pumping = False

    def _resume_next(self) -> None:
        callback_task, waiter = self._resuming.popleft()
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
        self._pump()

    def _dispatch(self, source: Source) -> CallbackTask | None:
        share, timing = self._share, source.timing
        clock, context = share.clock, share.context
        began = clock()
        share.until = began + SHARE_SEC
        callback_task: CallbackTask | None = None
        try:
            callback_task = context.run(source.dispatch, share)
        finally:
            # Calling one `async def` takes no time worth measuring; its steps count.
            if callback_task is None or not timing.only_turns:
                seconds = clock() - began
                self.budget.spend(seconds)
                timing.dispatched(seconds, source.calls)
            if changed(context, share.original):
                share.context = share.original.copy()
        return callback_task

    def _give(self, callback_task: CallbackTask) -> None:
        callback_task.holding = True
        self.running[callback_task] = None
        self._given.append(callback_task)
        if self._returning:
            return
        while self._idle:
            waiter = self._idle.popleft()
            if not waiter.done():
                waiter.set_result(None)
                return
        assert self._spawn is not None
        self.workers += 1
        self._spawn(self._work())

    async def _work(self) -> None:
        """Run turns until closed. A few idle workers wait for the next turn."""
        try:
            await self._work_on()
        finally:
            self.workers -= 1

    async def _work_on(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            while self._given:
                callback_task = self._given.popleft()
                await callback_task.run()
                if callback_task.holding:
                    callback_task.holding = False
                    self._busy = False
                    # This worker goes on with what the mailbox gives out now, so none is woken for it.
                    self._returning = True
                    self._pump()
                    self._returning = False
            # Closed meanwhile (the cancellation that came with it may have ended the turn), or not needed.
            if self._spawn is None or len(self._idle) >= IDLE_WORKERS:
                return
            waiter: asyncio.Future[None] = loop.create_future()
            self._idle.append(waiter)
            await waiter

    def run_beside(self, callback_task: CallbackTask) -> None:
        """Run a turn of a `concurrent=True` source soon, whoever holds the mailbox. They start in order."""
        if self._spawn is None:
            callback_task.discard()
        else:
            self.running[callback_task] = self._beside[callback_task] = None
            self._to_start.append(callback_task)
            self._start_beside()

    def _start_beside(self) -> None:
        """Start turns until as many as allowed wait for their first step."""
        budget, to_start = self.budget, self._to_start
        most = BESIDE_STARTS if budget.step_sec < SHORT_STEP_SEC else 1
        while to_start and len(self._beside) - len(to_start) < most and self._spawn is not None:
            if budget.exhausted:
                if not self._start_deferred:
                    self._start_deferred = True
                    budget.continue_later(self._continue_starting)
                return
            self._spawn(self._run_beside(to_start.popleft()))

    def _continue_starting(self) -> None:
        self._start_deferred = False
        self._start_beside()

    async def _run_beside(self, callback_task: CallbackTask) -> None:
        self._beside.pop(callback_task, None)
        if self._to_start and len(self._beside) == len(self._to_start):
            asyncio.get_running_loop().call_soon(self._start_beside)
        await callback_task.run()

    def release(self) -> None:
        """The holder lets go."""
        self._busy = False
        self._pump()

    async def take(self, callback_task: CallbackTask) -> None:
        """Wait until the turn holds the mailbox again."""
        if not self._busy and not self._pumping and not self._resuming:
            self._busy = callback_task.holding = True
            return
        waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._resuming.append((callback_task, waiter))
        await waiter


def _nothing() -> None:
    pass
