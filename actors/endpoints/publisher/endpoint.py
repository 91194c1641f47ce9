"""The runtime's side of a publisher.

Messages go into the batch of the loop turn, batches into the publisher queue, and the queue goes to the
broker as far as credit and the transport allow.

The batch belongs to this endpoint. The queue does, too, but while the broker of the session has accepted the
publisher (`accepted_now`), batches enter it through the outbox, which sends them. Before, between sessions,
and if the broker refuses the publisher, they enter it directly and wait. The numbers of messages are given
when a batch is built and stay the same in all sessions: with them subscriptions find repetitions and gaps.
"""

from __future__ import annotations

import secrets
import time
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actors.endpoints.endpoint import Endpoint
from actors.endpoints.events import PublisherEvents
from actors.endpoints.publisher import queue_limits
from actors.endpoints.publisher.qos_monitor import QoSMonitor
from actors.endpoints.publisher.retained import Retained
from actors.errors import PublisherFull
from actors.interfaces.message import definition, type_hash, type_name
from actors.qos.profile import UNLIMITED, DurabilityPolicy, HistoryPolicy, LivelinessPolicy
from proto import limits
from proto.queues.batches import MAX_HEAD_BYTES, BatchBuilder
from proto.queues.publisher_queue import PublisherQueue
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.identity import public_gid
from proto.wire.stamps import MAX_STAMPS, stamps_attribute

if TYPE_CHECKING:
    from actors.diagnostics.records import PublisherDiagnostics
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import PublisherEventCallbacks
    from actors.qos.profile import QoSProfile
    from proto.wire.frames import Buffer

LATCHED_MESSAGES: Final = 1000
"""Messages that a KEEP_ALL + TRANSIENT_LOCAL publisher keeps for a broker that restarts."""


class PublisherEndpoint(Endpoint):
    """What the runtime calls on a publisher.

    Attributes:
        gid: The id under which subscriptions know it, also across reconnects (`MessageInfo.publisher_gid`).
        queue: Its batches that have not been sent.
        space: Messages that may be published before the queue is checked again.
        large: Whether the last message was large.
        shares: Whether the last large message was put into shared memory.
        accepted_now: Whether the broker of this session has accepted the publisher.
        overflowed: Messages that other threads have published, and that were dropped before they got here.
        manual: Whether readers expect it to assert its liveliness.
        qos_monitor: Checks that it keeps its deadline and its lease; None if there are no callbacks to tell.
    """

    kind: ClassVar = "publisher"

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[Any],
        topic: str,
        qos: QoSProfile,
        event_callbacks: PublisherEventCallbacks | None,
        *,
        strict_qos: bool | None = None,
    ) -> None:
        # Without callbacks nobody sees the counts.
        events = None if event_callbacks is None else PublisherEvents(context, topic, event_callbacks)
        super().__init__(context, events)
        self._declared_gid = secrets.token_bytes(limits.INSTANCE_BYTES)
        self.gid = public_gid(context.link.token, self._declared_gid)
        self.space = 0
        self.large = self.shares = False
        self.accepted_now = False
        self.overflowed = 0
        self.interface = msg_type
        self._topic = topic
        self._qos = qos
        self._strict_qos = strict_qos
        resolved = qos.resolved()
        keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        depth = max(1, resolved.depth)
        self.queue = PublisherQueue(0, None if keep_all else depth)
        self._batch = BatchBuilder(0)
        self._batch_bytes = limits.BATCH_FLUSH_BYTES
        """Larger messages do not go into a batch of bytes, or only if there is no shared memory left."""
        self._stamps: list[int] = []
        """The stamps of the messages in the batch; none if they have the time when it is sent."""
        latched = resolved.durability == DurabilityPolicy.TRANSIENT_LOCAL
        self._mixes_stamps = not latched and resolved.lifespan == UNLIMITED
        """Whether messages of one batch may have different stamps: not where the broker looks at them, or
        keeps the batch."""
        self._keep = (LATCHED_MESSAGES if keep_all else depth) if latched else 0
        self._retained: Retained | None = None
        """The last `_keep` messages; None before the first one."""
        self._unlimited = True
        self._declared = 0
        """The number of the next message in the last declaration."""
        self.manual = resolved.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
        self.qos_monitor = None if events is None else QoSMonitor(context, resolved, events)
        context.link.add(self)

    @property
    def published(self) -> int:
        """Messages published so far."""
        return self._batch.next_sequence + self._batch.length

    @property
    def queued(self) -> int:
        """Messages that wait to be sent."""
        return self.queue.pending + self._batch.length

    @property
    def crowded(self) -> bool:
        """Whether another message would drop one, or should wait for slow readers."""
        return queue_limits.crowded(self.queue, self.queued)

    def require_space(self) -> None:
        """Set how many messages may be published before the next check; raise PublisherFull if none may.

        `publish` counts `space` down instead of asking the queue for each message. Whatever may leave less
        space than that sets it to 0, so that the next message asks again.
        """
        if self._stamps:
            self.flush_turn()
        self._check_space()

    def _check_space(self) -> None:
        self.require_alive()
        self.space = queue_limits.left(self.queue, self.queued)
        if not self.space:
            raise PublisherFull(
                f"'{self._topic}': {self.queued} messages wait for slow readers; await publisher.ready()"
            )

    def collect(self, data: bytes) -> None:
        """Put an encoded message into the batch of this loop turn, if the last one was not `large`."""
        size = len(data)
        if size > self._batch_bytes:
            self.collect_large(data, 0)
            return
        # As `BatchBuilder.add`, without the call: this runs for each message.
        batch = self._batch
        messages = batch.messages
        if not messages:  # the link knows of the batch from its first message on, and refuses other threads
            self.context.link.flush_later(self)
        messages.append(data)
        batch.size = size = batch.size + size
        if size >= limits.BATCH_FLUSH_BYTES or len(messages) >= limits.BATCH_FLUSH_COUNT:
            self.flush_turn()
            self.context.link.flush()

    def collect_encoded(self, data: bytes | memoryview) -> None:
        """Send a message of any size. It is copied if it is not bytes."""
        if self.large or len(data) > self._batch_bytes:
            self.collect_large(data, 0)
        else:
            self.collect(bytes(data))

    def collect_stamped(self, data: bytes | memoryview, stamp_ns: int) -> None:
        """Send a message with a stamp of its own.

        Raises:
            PublisherFull: As for `require_space`, which need not be called before.
        """
        stamps, batch = self._stamps, self._batch
        if (
            len(stamps) >= MAX_STAMPS
            or (not stamps and batch.length)
            or (stamps and stamp_ns != stamps[-1] and not self._mixes_stamps)
        ):
            self.flush_turn()
        self._check_space()
        self.space = 0  # so that the next message without a stamp asks for space, which ends this batch
        stamps.append(stamp_ns)
        try:
            self.collect_encoded(data)
        except BaseException:  # it is too large
            del stamps[batch.length :]
            raise

    def collect_large(self, buffer: Buffer, start: int = MAX_HEAD_BYTES) -> None:
        """Send a large message, or one that follows a large one.

        In shared memory others may follow it in the same batch. The next message is expected to be as large;
        unless this one goes through shared memory, that is encoded behind space for a head, which costs more
        but saves a copy.

        Args:
            buffer: Ends with the encoded message.
            start: Where it begins: at 0, or at `MAX_HEAD_BYTES` in a bytearray, which the batch may keep.
        """
        message = memoryview(buffer)[start:]
        size, link, queue, batch = len(message), self.context.link, self.queue, self._batch
        link.require_thread()
        shared = link.shared_memory
        link.require_fits(f"A message on '{self._topic}'", size)
        slot = None
        # Latched messages are kept for long: they would fill the memory. Without a session nobody can read
        # it.
        if size >= shared.min_bytes and self.accepted_now and not self._keep:
            slot = shared.put(message, batch.slot)
        self.shares = slot is not None
        self.large = self.shares or size > limits.BATCH_FLUSH_BYTES
        # A batch is all bytes or all one slot: what has been collected elsewhere precedes this message.
        if slot is not batch.slot:
            self.flush_turn()
        if slot is not None:
            batch.add_shared(slot)
            # Beyond the depth it goes into the queue at once, which drops the oldest: they only fill the
            # memory.
            if queue.depth is None or queue.pending + batch.length <= queue.depth:
                link.flush_later(self, size)
                return
            self.flush_turn()
        elif self.large:
            self.flush_turn()
            room = buffer if isinstance(buffer, bytearray) and start else bytearray(MAX_HEAD_BYTES) + message
            self._put(batch.single(room, queue.publisher, self._take_stamps(1)[0]))
        elif batch.add(bytes(message)):
            self.flush_turn()
        else:
            link.flush_later(self)
            return
        link.flush()

    def flush_turn(self) -> None:
        """Put the batch of this loop turn into the publisher queue. Called by the link."""
        batch = self._batch
        if count := batch.length:
            self._put(batch.build(self.queue.publisher, *self._take_stamps(count)))

    def _take_stamps(self, count: int) -> tuple[int, frames.Options | None]:
        """Return the stamp and the attributes of a batch of so many messages."""
        stamps = self._stamps
        if not stamps:
            return time.time_ns(), None
        # Behind them may be that of a message which is about to be collected.
        taken = stamps[:count]
        del stamps[:count]
        return taken[0], stamps_attribute(self._batch.next_sequence, taken)

    def _put(self, batch: frames.Batch) -> None:
        if self._keep:  # for a broker that restarts, whatever the queue drops
            if self._retained is None:
                self._retained = Retained(self._keep)
            self._retained.add(batch)
        if self.qos_monitor is not None and self.qos_monitor.active:
            self.qos_monitor.published()
        channel = self.context.link.channel
        if self.accepted_now and channel is not None:
            channel.outbox.enqueue(self.queue, batch)
        else:
            self.queue.put(batch)
            self.queue.trim()
            if self.refusal:
                self.queue.drop_larger(0)  # all: no message has 0 bytes
        if self.queue.pending_bytes >= queue_limits.KEEP_ALL_BYTES:
            self.space = 0

    def destroy(self) -> None:
        """Take the publisher out of service, after everything it has published has been sent."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        # What has been published is still sent: the queue outlives the publisher, in `context.departing`.
        self.flush_turn()
        self.destroyed = True
        if self.events is not None:
            self.events.stop()
        if self.qos_monitor is not None:
            self.qos_monitor.stop()
        self.space = 0
        context, link = self.context, self.context.link
        context.endpoints.pop(self, None)
        if self.accepted_now:
            self._undeclare()
            if link.channel is not None:
                self._depart()
        elif self.queue.pending and (link.channel is not None or context.stopping):
            self._depart()  # it is declared, and sends then
        else:
            if not self.standard:
                context.departing.report_unsent([self.queue])
            link.remove(self)
        link.wake()

    def _depart(self) -> None:
        """Let the queue outlive the publisher."""
        self.context.departing.add(self.queue, standard=self.standard)
        self.context.leaves_after(self)

    def _undeclare(self) -> None:
        """Send UNDECLARE after the unsent messages."""
        link = self.context.link
        link.remove(self, announce=False)
        if self._unlimited or not self.queue.pending:
            link.publishers.pop(self.queue.publisher, None)  # it needs no more credit
        if link.channel is not None:
            link.channel.outbox.enqueue(self.queue, encode(frames.Undeclare(self.id)))
            link.flush_later(self)

    def declaration(self) -> frames.Frame:
        """Declare the publisher; sequence numbers continue where an earlier session ended.

        Everything in the queue is sent for the first time: repetitions were dropped with the earlier session.
        """
        # Numbers below the declared one are stale to the broker, so it must not exceed what is sent again.
        oldest = None if self._retained is None else self._retained.first_sequence
        first = self.queue.first_sequence
        if first is None:
            first = self._batch.next_sequence
        self._declared = first if oldest is None else min(first, oldest)
        return frames.Publisher(
            self.id,
            self.context.id,
            self._topic,
            type_name(self.interface),
            type_hash(self.interface),
            self.context.declared_qos(self._topic, self._qos, strict_qos=self._strict_qos),
            self._declared_gid,
            self._declared,
            None if self.standard else definition(self.interface),
            first,
        )

    def accepted(self, number: int) -> None:
        """Take the id that the broker has given the publisher, and send the queue."""
        link = self.context.link
        channel = link.channel
        if channel is None:
            return
        # In this order: the latched messages are put in front of what waits, and must fit this broker, too.
        self.queue.restart(number, self._declared)
        self._drop_too_large()
        self._resend_retained()
        self.space = 0
        self.accepted_now = True
        if not self._keep:
            self._batch_bytes = min(limits.BATCH_FLUSH_BYTES, link.shared_memory.min_bytes - 1)
        self._unlimited = True
        if self.qos_monitor is not None:
            self.qos_monitor.asserted()
        link.publishers[number] = self
        channel.outbox.schedule(self.queue)
        if self.destroyed:
            self._undeclare()
        link.flush_later(self)

    def refused(self, code: int, text: str) -> None:
        """Drop the queue, because nothing will send it."""
        super().refused(code, text)
        self.flush_turn()
        self.queue.drop_larger(0)  # all: no message has 0 bytes
        if self.destroyed:
            self.context.link.remove(self, announce=False)
        self.context.link.wake()

    def _drop_too_large(self) -> None:
        """Drop messages that are too large for this broker, which would close the link."""
        largest = self.context.link.largest
        dropped = self.queue.drop_larger(largest)
        if dropped:
            self.context.log.error(
                f"'{self._topic}': dropped {dropped} messages over the limit of {largest} bytes"
            )
        if self._retained is not None:
            self._retained.drop_larger(largest)

    def _resend_retained(self) -> None:
        """Queue latched messages that an earlier broker had received again, before the unsent ones."""
        if self._retained is None:
            return
        for batch in self._retained.newest_first(before=self.queue.first_sequence):
            self.queue.put_front(batch)

    def credit_received(self, frame: frames.Credit) -> None:
        """Take the credit that the slowest KEEP_ALL subscription allows."""
        link = self.context.link
        channel = link.channel
        if channel is None:
            return
        if self.destroyed and self.queue.empty:
            # The CREDIT crossed the UNDECLARE: the broker has removed this publisher.
            link.publishers.pop(frame.publisher, None)
            return
        if self._unlimited and frame.sequence_limit is not None:
            # An echo: from it on the broker holds the publisher to the limit. After a batch that is partly
            # sent, before everything that waits for credit.
            channel.outbox.enqueue(self.queue, encode(frame), first=True)
        self._unlimited = frame.sequence_limit is None
        self.queue.sequence_limit = frame.sequence_limit
        self.queue.byte_limit = frame.byte_limit
        channel.outbox.schedule(self.queue)
        link.flush_later(self)

    def session_ended(self) -> None:
        """Keep messages in the queue again; KEEP_LAST drops those beyond its depth."""
        super().session_ended()
        self.accepted_now = False
        self._batch_bytes = limits.BATCH_FLUSH_BYTES
        self.queue.restart(0)
        self.queue.trim()
        self.space = 0

    def diagnostics(self) -> PublisherDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import PublisherDiagnostics  # noqa: PLC0415 - seldom needed

        queue = self.queue
        credit = queue.sequence_limit
        if credit is not None:
            first = queue.first_sequence
            credit = max(0, credit - (self._batch.next_sequence if first is None else first))
        return PublisherDiagnostics(
            id=self.id,
            topic=self._topic,
            matched=self.peers,
            published=self.published + self.overflowed,
            dropped=queue.dropped + self.overflowed,
            queued=self.queued,
            queued_bytes=queue.pending_bytes,
            queue_limit=queue_limits.limit(queue),
            credit=credit,
            events=() if self.events is None else self.events.diagnostics(),
        )
