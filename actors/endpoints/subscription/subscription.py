"""Subscriptions: runs come in, messages go to a callback or to `async for`.

A run that finds its reader idle is decoded whole, in one call. At a busy reader only the last `depth`
messages of a run are kept (before they are decoded). What the callback has not taken when it is busy, or when
the callback budget is exhausted, is held to the depth: the oldest are dropped and counted. With KEEP_ALL
nothing is dropped: the publisher gets credit as messages are taken.
"""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

from actors.callbacks.budget import SHARE_SEC
from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.diagnostics.records import SubscriptionDiagnostics
from actors.endpoints.context import Entity, NodeContext
from actors.endpoints.deadline import Deadline
from actors.endpoints.events import SubscriptionEventCallbacks, SubscriptionEvents
from actors.endpoints.flow_control.credit import DECLARED, CreditGrants
from actors.endpoints.subscription.backlog import Backlog, QueuedBatch
from actors.endpoints.subscription.decoding import Decoder
from actors.endpoints.subscription.liveliness import Liveliness
from actors.endpoints.subscription.sequence_tracker import SequenceTracker
from actors.interfaces.codec import codec_for
from actors.interfaces.message import Message, type_hash, type_name
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from proto import frames
from proto.batches import message_bytes, slice_batch
from proto.frames import Batch, Replay

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

    from actors.callbacks.mailbox import Share
    from actors.session.attachments import Attachment

M = TypeVar("M")

BEST_EFFORT_KEEP_ALL_DEPTH: Final = 1000
"""KEEP_ALL without RELIABLE pushes nobody back, so it needs a depth after all."""

MAX_CONCURRENT: Final = 1000
"""Callbacks of one `concurrent=True` subscription that run at the same time; more messages wait."""


CHECK_EVERY: Final = 8
"""Callbacks between two looks at the clock, which may cost more than a callback does: as long as ..."""

CHEAP_SEC: Final = 0.00005
"""... those before the last look took less than this in all. Otherwise the clock is read after each one."""


class Subscription(Entity, Generic[M]):
    """Hears messages on one topic. Made by `Node.create_subscription`.

    With a callback, messages go there. Without one, iterate: `async for msg in subscription`.

    Attributes:
        topic_name: The full name of the topic.
        qos_profile: Its QoS.
        dropped: Messages dropped here because the reader was slower than the depth allows.
        expired: Messages not handed over because they were older than their publisher's lifespan.
    """

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[Message] | None,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoSProfile,
        *,
        concurrent: bool,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks | None = None,
    ) -> None:
        typed = None if raw or msg_type is None else msg_type
        codec = None if typed is None else codec_for(typed)
        self._with_info = callback is not None and takes(callback, (1, 2), "subscription") == 2
        events = SubscriptionEvents(context, topic, event_callbacks or SubscriptionEventCallbacks())
        super().__init__(context, events)
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos
        self.posted = False
        self.calls = self.dropped = self.expired = 0
        self._typed = typed
        self._decoder = Decoder(codec, topic, context.log)
        resolved = qos.resolved()
        keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        self._tracker = SequenceTracker(
            events.message_lost, latched=resolved.durability == DurabilityPolicy.TRANSIENT_LOCAL
        )
        reliable = resolved.reliability == ReliabilityPolicy.RELIABLE
        self._grants = CreditGrants(self._tracker, self._grant) if keep_all and reliable else None
        self._depth = BEST_EFFORT_KEEP_ALL_DEPTH if keep_all else max(1, resolved.depth)
        self._callback = callback
        self.timing = context.watch.of(callback, f"the subscription to '{topic}'")
        self._concurrent = concurrent
        self._backlog = Backlog(None if self._grants is None else self._grants.finished)
        self._running = 0
        self._events = events
        self._liveliness = Liveliness(context, events.liveliness)
        self._deadline = Deadline(context, resolved.deadline, events.deadline)
        self._waiter: asyncio.Future[None] | None = None
        context.link.add(self)
        context.link.attachments.add_reader(self.id, self)

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def lost(self) -> int:
        """Messages that never came over an unbroken link: dropped by the broker or the publisher."""
        return self._tracker.lost

    @property
    def lost_on_break(self) -> int:
        """Messages that never came because a link broke."""
        return self._tracker.lost_on_break

    @property
    def undecodable(self) -> int:
        """Messages dropped because they were not valid."""
        return self._decoder.failed

    @property
    def received(self) -> int:
        """Messages handed to the callback or the iterator."""
        return self.calls

    @property
    def queued(self) -> int:
        """Messages that have come and wait for the callback or the iterator."""
        return self._backlog.pending

    def get_publisher_count(self) -> int:
        """Return how many publishers are matched now."""
        return self.peers

    # What comes in

    def attached(self, attachment: Attachment) -> None:
        """Reader: a publisher's runs will come. Known publishers go on where they stopped."""
        replaced = self._tracker.attached(attachment)
        leased = self._liveliness.attached(attachment)
        attachment.watched = leased or self._deadline.wanted
        if self._grants is not None:
            if replaced:
                self._grants.detached(self._backlog.newest)
            self._grants.attached(attachment)

    def asserted(self, attachment: Attachment) -> None:
        """Reader: a publisher is alive."""
        self._liveliness.heard(attachment)

    def forgotten(self, attachment: Attachment) -> None:
        """Reader: a publisher that was silent is back, or gone."""
        del attachment
        self._liveliness.forgotten()

    def detached(self, attachment: Attachment, *, silent: bool = False) -> None:
        """Reader: no more runs of this publisher; what is queued stays."""
        self._liveliness.detached(attachment, silent=silent)
        if self._tracker.detached(attachment) and self._grants is not None:
            self._grants.detached(self._backlog.newest)

    def matched(self, peers: int, total: int) -> None:
        """Endpoint: the number of publishers; the deadline holds while there is one."""
        super().matched(peers, total)
        if peers:
            self._deadline.begin()
        else:
            self._deadline.end()

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        """Reader: a run, or latched messages. What has been seen is discarded, gaps are counted."""
        if not attachment.counts:
            return
        if isinstance(batch, Batch):
            if attachment.watched:
                self._shown(attachment, batch)
            start, size = self._tracker.live(attachment, batch), message_bytes(batch)
        else:
            start, size = self._tracker.latched(attachment, batch), 0
        stop = batch.length
        end = batch.first_sequence + stop
        if start < stop and self._keep(attachment, batch, start, size):
            self._wake()
        elif self._grants is not None:
            self._grants.taken(attachment, end, size)

    def _keep(self, attachment: Attachment, batch: Batch | Replay, start: int, size: int) -> bool:
        """Put the messages of a run from `start` on into the backlog; return whether there are any."""
        stop = batch.length
        end = batch.first_sequence + stop
        if self._grants is None and not self._idle and stop - start > self._depth:
            self._drop(stop - start - self._depth)
            start = stop - self._depth
        if start:
            batch = slice_batch(_as_batch(batch), start, stop)
        decoded, numbers = self._decoder.decode(batch)
        if not decoded:
            return False
        queued_batch = QueuedBatch(attachment, batch, decoded, numbers, time.time_ns())
        queued_batch.end, queued_batch.size = end, size
        if attachment.lifespan_s:
            age_s = max(0, queued_batch.received_ns - queued_batch.stamp_ns) / 1e9
            queued_batch.expires_at = self.context.require_loop().time() + attachment.lifespan_s - age_s
        self._backlog.put(queued_batch)
        return True

    def _shown(self, attachment: Attachment, batch: Batch) -> None:
        """A publisher has published, and is alive; what is not for this subscription keeps no deadline.

        Nor does what it has seen: those are latched messages that come again, from a new broker. Such as it
        missed are new to a TRANSIENT_LOCAL subscription.
        """
        self._liveliness.heard(attachment)
        if batch.first_sequence + batch.length > attachment.expected:
            self._deadline.met()

    def _drop(self, count: int) -> None:
        self.dropped += count
        self._events.message_lost.add(count)

    @property
    def _idle(self) -> bool:
        if self._callback is None:
            return self._waiter is not None  # it waits, or has been woken and will take what is there by then
        if self._backlog.pending:
            return False
        return not self._running and (self._concurrent or self.context.mailbox.free)

    # What goes out

    def _wake(self) -> None:
        if self._callback is not None:
            self.context.mailbox.post(self)
        elif self._waiter is not None:
            # An idle iterator takes what has come in the step it is woken for; what it has not taken by then
            # waits, and is held to the depth.
            if not self._waiter.done():
                self._waiter.set_result(None)
                asyncio.get_running_loop().call_soon(self._trim)
            return
        self._trim()

    def _trim(self) -> None:
        """Drop the oldest beyond the depth."""
        if self._grants is None and self._backlog.pending > self._depth:
            self._drop(self._backlog.trim(self._depth))

    def _expire(self) -> None:
        """Throw away what is at the front and too old."""
        self.expired += self._backlog.expire(self.context.require_loop().time())

    def _grant(self, attachment: Attachment) -> None:
        channel = self.context.link.channel
        if channel is not None and not self.destroyed:
            channel.send(
                frames.Grant(
                    self.id, attachment.publisher, attachment.granted_sequence, attachment.granted_bytes
                )
            )

    def has_work(self) -> bool:
        """Source: whether a callback could run now."""
        limit = MAX_CONCURRENT if self._concurrent else 1
        return bool(self._backlog.batches) and self._running < limit and not self.destroyed

    def dispatch(self, share: Share) -> CallbackTask | None:
        """Source: run the callback for what waits, until it returns something to await."""
        batches = self._backlog.batches
        while self.has_work() and self._next_is_fresh():
            coroutine = self._run(batches[0], share)
            if coroutine is not None:
                self._running += 1
                callback_task = CallbackTask(
                    self.context.mailbox, coroutine, self._ended, timing=self.timing, beside=self._concurrent
                )
                if not self._concurrent:
                    return callback_task
                self.context.mailbox.run_beside(callback_task)
            if not batches or share.used:
                break
        return None

    def _run(self, queued_batch: QueuedBatch, share: Share) -> Coroutine[Any, Any, Any] | None:
        """Run the callback for the messages of a batch, as far as the share goes or to something to await."""
        callback, waiting = self._callback, queued_batch.messages
        assert callback is not None
        callback = _with_info(callback, queued_batch) if self._with_info else callback
        backlog, index, size = self._backlog, queued_batch.index, len(waiting)
        context, original = share.context, share.original
        clock, until, check_at = share.clock, share.until, index + 1
        checked = until - SHARE_SEC
        while index < size and not self.destroyed:
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
        self._running -= 1
        if error is not None:
            self.context.callback_failed(self.timing.what, error)
        if self.has_work():
            self.context.mailbox.post(self)

    async def __aiter__(self) -> AsyncIterator[M]:
        """Iterate over messages as they come; ends when the subscription or its node is destroyed."""
        if self._callback is not None:
            raise TypeError("This subscription has a callback; make one without to iterate")
        loop = self.context.require_loop()
        while not self.destroyed:
            while self._next_is_fresh():
                self.calls += 1
                yield cast("M", self._backlog.take())
            if self.destroyed:
                return
            if self._waiter is not None and not self._waiter.done():
                raise RuntimeError("Another task is iterating over this subscription")
            self._waiter = loop.create_future()
            try:
                await self._waiter
            finally:
                self._waiter = None

    def _next_is_fresh(self) -> bool:
        """Tell whether there is a message to take, after those that have got too old are gone."""
        batches = self._backlog.batches
        if batches and batches[0].expires_at < math.inf:
            self._expire()
        return bool(batches)

    def retire(self) -> None:
        """The node stops: hear nothing more; what waits is counted as unread."""
        self.context.unread += self._backlog.pending
        self.destroy()

    def destroy(self) -> None:
        """Hear nothing more; what waits is discarded."""
        if self.destroyed:
            return
        super().destroy()
        self.context.link.attachments.remove_reader(self.id)
        self._backlog.clear()
        self._liveliness.stop()
        self._deadline.end()
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def link_lost(self) -> None:
        """Endpoint: the session has ended, and with it every publisher."""
        super().link_lost()
        self._deadline.end()

    def diagnostics(self) -> SubscriptionDiagnostics:
        """Say how it is doing."""
        return SubscriptionDiagnostics(
            id=self.id,
            topic=self.topic_name,
            matched=self.peers,
            received=self.calls,
            queued=self.queued,
            queue_limit=self._depth if self._grants is None else self._grants.limit,
            running=self._running,
            dropped=self.dropped,
            expired=self.expired,
            lost=self.lost,
            lost_on_break=self.lost_on_break,
            undecodable=self.undecodable,
            callback=None if self._callback is None else self.timing.diagnostics(self.calls),
            events=self._events.diagnostics(),
        )

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the subscription."""
        typed = self._typed
        return frames.Subscription(
            self.id,
            self.context.id,
            self.topic_name,
            None if typed is None else type_name(typed),
            None if typed is None else type_hash(typed),
            self.qos_profile.to_wire(),
            *DECLARED,
        )


def _as_batch(batch: Batch | Replay) -> Batch:
    """Return a replay as the run it carries, so that it can be cut."""
    return batch if isinstance(batch, Batch) else Batch(*batch[1:], b"")


def _with_info(callback: Callable[..., Any], queued_batch: QueuedBatch) -> Callable[[Any], Any]:
    """Return the callback as a function of a message that has just been taken from the batch."""
    return lambda message: callback(message, queued_batch.info())
