"""The runtime's side of a subscription: from batches of the link to the consumer's backlog.

A batch for an idle consumer is decoded whole, in one call. For a busy consumer only the last `depth`
messages of a batch are kept, before they are decoded. With KEEP_ALL nothing is dropped: the publisher gets
credit as messages are taken.

Every message of a batch ends in one count: handed to the callback, dropped or expired (consumer), undecodable
(decoder), waiting (backlog), or a repetition, which is no message of its own; one that is not wanted
(`selection.py`) in none. Numbers that never arrive are
the tracker's `lost` and `lost_on_break`.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actors.endpoints.deadline import Deadline
from actors.endpoints.endpoint import Endpoint
from actors.endpoints.events import SubscriptionEventCallbacks, SubscriptionEvents
from actors.endpoints.subscription.backlog import QueuedBatch
from actors.endpoints.subscription.consumer import Consumer
from actors.endpoints.subscription.credit import DECLARED, SubscriptionCredit
from actors.endpoints.subscription.decoding import Decoder, SelectingDecoder
from actors.endpoints.subscription.liveliness import Liveliness
from actors.endpoints.subscription.sequence_tracker import SequenceTracker
from actors.interfaces.codec import codec_for
from actors.interfaces.message import type_hash, type_name
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy
from proto import limits
from proto.queues.batches import message_bytes, slice_batch
from proto.wire import frames
from proto.wire.codes import NoticeKind
from proto.wire.frames import Batch, Replay

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.diagnostics.records import SubscriptionDiagnostics
    from actors.endpoints.context import NodeContext
    from actors.qos.profile import QoSProfile
    from actors.session.attachments import Attachment

BEST_EFFORT_KEEP_ALL_DEPTH: Final = 1000
"""Depth of KEEP_ALL without RELIABLE, which grants no credit and so needs a limit."""


class SubscriptionEndpoint(Endpoint):
    """What the runtime calls on a subscription: a `Reader` of the link's attachments.

    Attributes:
        consumer: Takes the messages.
        decoder: Decodes them.
        tracker: Keeps what is received in order, and counts what is lost.
    """

    kind: ClassVar = "subscription"

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[Any] | None,
        topic: str,
        callback: Callable[..., Any] | None,
        qos: QoSProfile,
        *,
        concurrent: bool,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks | None,
        stall_timeout_sec: float = 0.0,
        strict_qos: bool | None = None,
    ) -> None:
        codec = None if raw or msg_type is None else codec_for(msg_type)
        events = SubscriptionEvents(context, topic, event_callbacks or SubscriptionEventCallbacks())
        resolved = qos.resolved()
        keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        latched = resolved.durability == DurabilityPolicy.TRANSIENT_LOCAL
        pushes_back = keep_all and resolved.reliability == ReliabilityPolicy.RELIABLE
        depth = BEST_EFFORT_KEEP_ALL_DEPTH if keep_all else max(1, resolved.depth)
        self.interface, self._topic, self._qos, self._strict_qos = msg_type, topic, qos, strict_qos
        self._stall_ms = min(round(stall_timeout_sec * 1000), limits.MAX_U32)
        self._events = events
        self.decoder: Decoder | SelectingDecoder = Decoder(codec, topic, context.log)
        self.tracker = SequenceTracker(events.message_lost, latched=latched)
        self._credit = self._begin_credit(context) if pushes_back else None
        self.consumer = Consumer(
            context,
            topic,
            callback,
            depth=None if pushes_back else depth,
            message_lost=events.message_lost,
            finished=None if self._credit is None else self._credit.finished,
            concurrent=concurrent,
        )
        self._liveliness = Liveliness(context, events.liveliness)
        self._deadline = Deadline(context, resolved.deadline, events.deadline)
        super().__init__(context, events)
        context.link.add(self)
        context.link.attachments.add_reader(self.id, self)

    def _begin_credit(self, context: NodeContext) -> SubscriptionCredit:
        context.link.ticks[self._report_progress] = None
        return SubscriptionCredit(self.tracker, self._grant)

    def attached(self, attachment: Attachment) -> None:
        """Reader: a publisher's batches will arrive. A known publisher continues where it stopped."""
        replaced = self.tracker.attached(attachment)
        leased = self._liveliness.attached(attachment)
        attachment.watched = leased or self._deadline.wanted
        if self._credit is not None:
            if replaced:
                self._credit.detached(self.consumer.backlog.newest)
            self._credit.attached(attachment)

    def notice(self, notice: frames.Notice) -> None:
        """Log a warning of the broker; track no publisher that has stopped to wait for this subscription."""
        super().notice(notice)
        if notice.kind == NoticeKind.STALLED and self._credit is not None:
            stalled = [each for each in self.tracker.attachments.values() if each.keep_all]
            for attachment in stalled:
                self.tracker.detached(attachment)
            self._credit.stalled(stalled, self.consumer.backlog.newest)

    def _report_progress(self) -> None:
        if self._credit is not None:
            self._credit.report_progress(self.consumer.calls, self.consumer.backlog.pending)

    def asserted(self, attachment: Attachment) -> None:
        """Reader: a publisher has asserted its liveliness."""
        self._liveliness.mark_alive(attachment)

    def suspension_ended(self) -> None:
        """Reader: a suspended publisher is back, or gone."""
        self._liveliness.suspension_ended()

    def detached(self, attachment: Attachment, *, suspended: bool = False) -> None:
        """Reader: no more batches of this publisher will arrive; those that wait stay."""
        self._liveliness.detached(attachment, suspended=suspended)
        if self.tracker.detached(attachment) and self._credit is not None:
            self._credit.detached(self.consumer.backlog.newest)

    def matched(self, peers: int, total: int) -> None:
        """Note the number of publishers; the deadline holds while there is one."""
        super().matched(peers, total)
        if peers:
            self._deadline.begin()
        else:
            self._deadline.end()

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        """Reader: take a batch, or latched messages. Repetitions are discarded, gaps are counted."""
        # A publisher that came back may be attached twice for a moment; its newest attachment counts.
        if not attachment.current:
            return
        if isinstance(batch, Batch):
            if attachment.watched:
                self._note_sign_of_life(attachment, batch)
            start, size = self.tracker.live(attachment, batch), message_bytes(batch)
        else:
            start, size = self.tracker.latched(attachment, batch), 0
        stop = batch.length
        # A batch of which nothing is kept is done at once: its credit would otherwise never be granted again.
        if start < stop and self._keep(attachment, batch, start, size):
            self.consumer.wake()
        elif self._credit is not None:
            self._credit.consumed(attachment, batch.first_sequence + stop, size)

    def _keep(self, attachment: Attachment, batch: Batch | Replay, start: int, size: int) -> bool:
        """Put the messages of a batch from `start` on into the backlog; return whether there are any."""
        stop, consumer = batch.length, self.consumer
        end = batch.first_sequence + stop
        # Dropped before they are decoded, which costs more than all the rest. An idle consumer takes the
        # batch as it arrives, so nothing of it is beyond the depth.
        depth, idle = consumer.depth, consumer.idle
        if depth is not None and stop - start > depth and not idle and not self.decoder.selects:
            consumer.drop(stop - start - depth)
            start = stop - depth
        if start:
            batch = slice_batch(_as_batch(batch), start, stop)
        decoded, numbers = self.decoder.decode(batch, idle=idle)
        if not decoded:
            return False
        queued_batch = QueuedBatch(attachment, batch, decoded, numbers, time.time_ns())
        queued_batch.end, queued_batch.size = end, size
        if attachment.lifespan_s:
            age_ns = 0 if self.context.ros_time.active else queued_batch.received_ns - queued_batch.stamp_ns
            age_s = max(0, age_ns) / 1e9  # stamps are real time
            queued_batch.expires_at = self.context.time() + attachment.lifespan_s - age_s
        consumer.backlog.put(queued_batch)
        return True

    def _note_sign_of_life(self, attachment: Attachment, batch: Batch) -> None:
        """Note that a publisher is alive and, unless it repeats itself, keeps the deadline.

        A new broker may send latched messages again. Those that a TRANSIENT_LOCAL subscription missed are new
        to it.
        """
        self._liveliness.mark_alive(attachment)
        if batch.first_sequence + batch.length > attachment.expected:
            self._deadline.met()

    def _grant(self, attachment: Attachment) -> None:
        channel = self.context.link.channel
        if channel is not None and not self.destroyed:
            channel.send(
                frames.Grant(
                    self.id, attachment.publisher, attachment.granted_sequence, attachment.granted_bytes
                )
            )

    def retire(self) -> None:
        """Receive nothing more, as the node stops; messages that wait are counted as unread."""
        self.context.unread += self.consumer.backlog.pending
        self.destroy()

    def destroy(self) -> None:
        """Take the subscription out of service; messages that wait are discarded."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        super().destroy()
        self.context.link.attachments.remove_reader(self.id)
        self.context.link.ticks.pop(self._report_progress, None)
        self.consumer.close()
        self._liveliness.stop()
        self._deadline.end()

    def time_shifted(self, seconds: float) -> None:
        """Keep what is left of the lifespans of messages that wait."""
        self.consumer.backlog.shift(seconds)

    def session_ended(self) -> None:
        """Forget every publisher; messages that wait stay."""
        super().session_ended()
        self._liveliness.session_ended()
        self.tracker.session_ended()
        if self._credit is not None:
            self._credit.stalled([], self.consumer.backlog.newest)
        self._deadline.end()

    def declaration(self) -> frames.Frame:
        """Declare the subscription."""
        typed = self.interface
        return frames.Subscription(
            self.id,
            self.context.id,
            self._topic,
            None if typed is None else type_name(typed),
            None if typed is None else type_hash(typed),
            self.context.declared_qos(self._topic, self._qos, strict_qos=self._strict_qos),
            *DECLARED,
            self._stall_ms,
        )

    @property
    def undecodable(self) -> int:
        """Messages dropped because they could not be read."""
        return self.decoder.failed + self.consumer.rejected

    def diagnostics(self) -> SubscriptionDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import SubscriptionDiagnostics  # noqa: PLC0415 - seldom needed

        consumer = self.consumer
        return SubscriptionDiagnostics(
            id=self.id,
            topic=self._topic,
            matched=self.peers,
            received=consumer.calls,
            queued=consumer.backlog.pending,
            queue_limit=consumer.depth or 0 if self._credit is None else self._credit.limit,
            running=consumer.running,
            dropped=consumer.dropped,
            expired=consumer.expired,
            lost=self.tracker.lost,
            lost_on_break=self.tracker.lost_on_break,
            undecodable=self.undecodable,
            callback=None if consumer.callback is None else consumer.timing.diagnostics(consumer.calls),
            events=self._events.diagnostics(),
        )


def _as_batch(batch: Batch | Replay) -> Batch:
    """Return a replay as the batch that it carries, so that it can be cut."""
    return batch if isinstance(batch, Batch) else Batch(*batch[1:], b"")
