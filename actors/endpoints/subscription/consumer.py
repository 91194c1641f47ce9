"""Hands a subscription's messages to its callback, through the node's mailbox, to `async for` or to `take`.

An idle consumer takes a whole batch. A busy one keeps its backlog to the depth: the oldest messages are
dropped and counted, as well as what the callback has not taken when the callback budget is exhausted.
`take` may be called in any thread; at most the depth waits for it.
"""

from __future__ import annotations

import asyncio
import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.budget import SHARE_SEC
from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.endpoints.subscription.backlog import Backlog, MessageInfo, QueuedBatch, SharedBacklog

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.callbacks.source import Share
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import Event

MAX_CONCURRENT: Final = 1000
"""Callbacks of one `concurrent=True` subscription that run at the same time; more messages wait."""

CHECK_EVERY: Final = 8
"""Cheap callbacks between two readings of the clock, which may cost more than such a callback."""

CHEAP_SEC: Final = 0.00005
"""Callbacks that took longer since the last reading are not cheap: the clock is read after each one."""


class Consumer:
    """The consumer of one subscription.

    Args:
        context: The node.
        topic: The topic's name, for messages.
        callback: Gets the messages; None if they are iterated over.
        depth: Messages that may wait; None for no limit, as credit limits them.
        message_lost: Counts dropped messages.
        finished: Called with each batch that has been taken, in order; None if not needed.
        concurrent: Whether callbacks run at the same time as each other and as the node's others.

    Attributes:
        backlog: Messages that wait.
        calls: Messages handed to the callback or the iterator.
        rejected: Messages that the taker could not read.
        dropped: Messages dropped here because the consumer was slower than the depth allows.
        expired: Messages dropped because they were older than their publisher's lifespan.
        running: Callbacks that are suspended.
        waiter: Set while an idle iterator waits.
        closed: Whether nothing is handed over any more.
        posted, timing, concurrent: See `CallbackSource`.
    """

    def __init__(
        self,
        context: NodeContext,
        topic: str,
        callback: Callable[..., Any] | None,
        *,
        depth: int | None,
        message_lost: Event,
        finished: Callable[[QueuedBatch], None] | None,
        concurrent: bool,
    ) -> None:
        self._with_info = callback is not None and takes(callback, (1, 2), "subscription") == 2
        self.context = context
        self._shared = SharedBacklog(finished, self._call_in_loop) if callback is None else None
        self.backlog: Backlog = self._shared or Backlog(finished)
        self.calls = self.rejected = self.dropped = self.expired = 0
        self.running = 0
        self.waiter: asyncio.Future[None] | None = None
        self.posted = False
        self.timing = context.watch.of(callback, "the subscription to", topic)
        self.depth = depth
        self.callback = callback
        self._message_lost = message_lost
        self.concurrent = concurrent
        self._most = MAX_CONCURRENT if concurrent else 1
        """Callbacks that may be suspended at the same time."""
        self._on_ready: Callable[[], object] | None = None
        self._ready_due = False
        self.closed = False

    @property
    def idle(self) -> bool:
        """Whether it would take a batch at once."""
        if self.callback is None:
            # It waits, or has been woken and takes what is there by then. One whose wait has been cancelled
            # may never come back.
            return self.waiter is not None and not self.waiter.cancelled()
        if self.backlog.pending:
            return False
        return not self.running and (self.concurrent or self.context.mailbox.free)

    def wake(self) -> None:
        """Hand over what the backlog holds, now or as soon as the mailbox is free."""
        if self.callback is not None:
            self.context.mailbox.post(self)  # runs the callback here and now if the mailbox is free
        elif self.waiter is not None and not self.waiter.cancelled():
            # An idle iterator takes what is there in the step that it is woken for; the rest waits, and is
            # held to the depth.
            if not self.waiter.done():
                self.waiter.set_result(None)
                asyncio.get_running_loop().call_soon(self._trim)
            return
        self._trim()
        if self._on_ready is not None:
            self._report_ready()

    def set_on_ready(self, on_ready: Callable[[], object] | None) -> None:
        """Set what is called when messages wait for `take`."""
        self.require_no_callback("take")
        self._on_ready = on_ready
        if self.backlog.batches and on_ready is not None:
            self._report_ready()

    def _report_ready(self) -> None:
        """Call the hook in the next loop turn, once for all batches of this one."""
        if not self._ready_due:
            self._ready_due = True
            self.context.require_loop().call_soon(self._ready)

    def _ready(self) -> None:
        self._ready_due = False
        if self._on_ready is None or self.closed:
            return
        try:
            self._on_ready()
        except ENDS_PROGRAM:
            raise
        except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, the node lives on
            self.context.callback_failed(f"on_ready of {self.timing.what}", error)

    def drop(self, count: int) -> None:
        """Count messages that are dropped."""
        self.dropped += count
        self._message_lost.add(count)

    def _trim(self) -> None:
        """Drop the oldest messages beyond the depth."""
        if self.depth is not None and self.backlog.pending > self.depth:
            self.drop(self.backlog.trim(self.depth))

    def has_work(self) -> bool:
        """CallbackSource: whether a callback could run now."""
        return self.running < self._most and bool(self.backlog.batches) and not self.closed

    def dispatch(self, share: Share) -> CallbackTask | None:
        """CallbackSource: run the callback for what waits, until it returns something to await."""
        batches = self.backlog.batches
        while self.has_work() and self.next_is_fresh():
            coroutine = self._run(batches[0], share)
            if coroutine is not None:
                self.running += 1
                callback_task = CallbackTask(self.context.mailbox, coroutine, self._ended, self.timing)
                if not self.concurrent:
                    return callback_task
                self.context.mailbox.run_concurrently(callback_task)
            if not batches or share.used:
                break
        return None

    def _run(self, queued_batch: QueuedBatch, share: Share) -> Coroutine[Any, Any, Any] | None:
        """Run the callback for the messages of a batch, as far as the share goes or to something to await."""
        callback, waiting = self.callback, queued_batch.messages
        assert callback is not None
        callback = _with_info(callback, queued_batch) if self._with_info else callback
        backlog, index, size = self.backlog, queued_batch.index, len(waiting)
        context, original = share.context, share.original
        clock, until, check_at = share.clock, share.until, index + 1
        checked = until - SHARE_SEC
        while index < size and not self.closed:
            # Everything is counted before the callback runs: it may look at the counts, destroy the
            # subscription, or raise.
            message = waiting[index]
            queued_batch.index = index = index + 1
            backlog.pending -= 1
            self.calls += 1
            if index == size:
                backlog.finish()
            try:
                result = callback(message)
            except ENDS_PROGRAM:
                raise
            except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, the node lives on
                self.context.callback_failed(self.timing.what, error)
                result = None
            if result is not None and (coroutine := as_coroutine(result)) is not None:
                return coroutine
            # A callback that has set a context variable gets no others after it in the same context.
            try:
                if context != original:
                    break
            except Exception:  # noqa: BLE001 - the user's values do not compare: see `changed`
                break
            if index == check_at and index < size:
                now = clock()
                if now >= until:
                    break
                check_at = index + (CHECK_EVERY if now - checked < CHEAP_SEC else 1)
                checked = now
        return None

    def _ended(self, result: object, error: BaseException | None) -> None:
        del result
        self.running -= 1
        if error is not None:
            self.context.callback_failed(self.timing.what, error)
        if self.backlog.batches:
            self.context.mailbox.post(self)

    async def wait(self) -> None:
        """Wait until messages have arrived, or the consumer has been closed: for the task that iterates."""
        if self.waiter is not None and not self.waiter.done():
            raise RuntimeError("Another task is iterating over this subscription")
        waiter = self.waiter = self.context.require_loop().create_future()
        try:
            await waiter
        finally:
            # Once it is done, another task may wait before this one goes on.
            if self.waiter is waiter:
                self.waiter = None

    def wake_waiter(self) -> None:
        """Let the task that iterates look again."""
        if self.waiter is not None and not self.waiter.done():
            self.waiter.set_result(None)

    def take(self) -> tuple[Any, MessageInfo] | None:
        """Return the oldest message that waits and its info, or None. Any thread may call it."""
        shared = self.require_no_callback("take")
        with shared.lock:
            if not self.next_is_fresh():
                return None
            self.calls += 1
            queued_batch = shared.batches[0]
            return shared.pop(), queued_batch.info()

    def reject(self) -> None:
        """Count a message that was taken as one that cannot be read; in the thread that has taken it."""
        with self.require_no_callback("take").lock:
            self.calls -= 1
            self.rejected += 1

    def require_no_callback(self, purpose: str) -> SharedBacklog:
        """Return the backlog.

        Args:
            purpose: What the caller wants to do, for the error: "take".

        Raises:
            TypeError: The subscription has a callback, which reads it.
        """
        if self._shared is None:
            raise TypeError(f"This subscription has a callback; make one without to {purpose}")
        return self._shared

    def _call_in_loop(self, function: Callable[[], None]) -> None:
        loop = self.context.link.loop
        try:
            if loop is asyncio.get_running_loop():
                function()
                return
        except RuntimeError:  # a thread without a loop
            pass
        if loop is not None:
            with suppress(RuntimeError):  # it has been closed: no publisher waits for credit
                loop.call_soon_threadsafe(function)

    def next_is_fresh(self) -> bool:
        """Drop expired messages; return whether there is a message to take."""
        batches = self.backlog.batches
        if batches and batches[0].expires_at < math.inf:
            self.expired += self.backlog.expire(self.context.time())
        return bool(batches)

    def close(self) -> None:
        """Discard the backlog, and end the iteration."""
        self.closed = True
        self.backlog.clear()
        self.wake_waiter()


def _with_info(callback: Callable[..., Any], queued_batch: QueuedBatch) -> Callable[[Any], Any]:
    """Return the callback as a function of a message that has just been taken from the batch."""
    return lambda message: callback(message, queued_batch.info())
