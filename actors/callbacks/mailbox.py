"""One callback at a time: the mailbox that a node's callbacks run through.

A *source* (subscription, service, timer) posts itself when it has something to run. While the mailbox is
free, plain functions run at once, where the message arrives: no task, no await, no wake-up. A coroutine runs
as a *turn* in a worker task; the mailbox stays taken until it ends.

There is one point of interleaving. A turn that is suspended while a callboard call of its own is in flight
(a service call, a wait for a peer) lets go of the mailbox, and takes it again before it goes on. So a
callback may call any service, its own node's too, in circles, through `gather` or in tasks it starts, and
nothing can deadlock.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.callbacks.callback_task import CallbackTask
    from actors.callbacks.timing import CallbackTiming

IDLE_WORKERS: Final = 16
"""Workers kept for the next turns; more end as soon as they have nothing to do."""


class Source(Protocol):
    """Something with callbacks to run."""

    posted: bool
    """Whether it stands in the mailbox's queue; kept by the mailbox."""
    timing: CallbackTiming
    """How long its callback takes; kept by the mailbox and the turns."""

    @property
    def calls(self) -> int:
        """How often its callback has been called so far."""
        ...

    def dispatch(self) -> CallbackTask | None:
        """Run queued callbacks until one turns out to be a coroutine; return that as a turn."""
        ...

    def has_work(self) -> bool:
        """Whether `dispatch` would run something now."""
        ...


class Mailbox:
    """Runs the callbacks of one node, one at a time.

    Bounded: the queue holds each source once; there are as many workers as turns at the same time, and a few
    that wait for the next one. How many turns there may be is the sources' business.

    Attributes:
        workers: Tasks that run turns, or wait for one.
        running: The turns that have begun, or are about to.
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
        self._beside: set[CallbackTask] = set()
        """Turns whose task has not begun yet."""
        self._idle: deque[asyncio.Future[None]] = deque()
        self._busy = False
        self._pumping = False
        self._returning = False
        self._spawn: Callable[[Coroutine[Any, Any, None]], object] | None = None

    def open(self, spawn: Callable[[Coroutine[Any, Any, None]], object]) -> None:
        """Start to run callbacks; `spawn` starts a task that its owner awaits or cancels."""
        self._spawn = spawn
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
        while self._beside:
            self._beside.pop().discard()

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
        return not self._busy and not self._pumping and not self._ready and self._spawn is not None

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
                    callback_task, waiter = self._resuming.popleft()
                    if not waiter.done():
                        self._busy = callback_task.holding = True
                        waiter.set_result(None)
                    continue
                if not self._ready:
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

    @staticmethod
    def _dispatch(source: Source) -> CallbackTask | None:
        timing = source.timing
        if timing.only_turns:
            return source.dispatch()
        began = timing.clock()
        callback_task = source.dispatch()
        timing.dispatched(timing.clock() - began, source.calls)
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
        """Run a turn of a `concurrent=True` source now, whoever holds the mailbox."""
        if self._spawn is None:
            callback_task.discard()
        else:
            self.running[callback_task] = None
            self._beside.add(callback_task)
            self._spawn(self._run_beside(callback_task))

    async def _run_beside(self, callback_task: CallbackTask) -> None:
        self._beside.discard(callback_task)
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
