"""Publishers: messages go into a run, runs into a lane, the lane to the broker as credit and room allow."""

from __future__ import annotations

import asyncio
import secrets
import time
from typing import Final, Generic, TypeVar

from actors.diagnostics.records import PublisherDiagnostics
from actors.endpoints.context import Entity, NodeContext, in_flight
from actors.endpoints.events import PublisherEventCallbacks, PublisherEvents
from actors.endpoints.flow_control import queue_limits as room
from actors.endpoints.publisher.qos_monitor import QoSMonitor
from actors.endpoints.publisher.retained import Retained
from actors.errors import PublisherFull, PublisherRefused, WaitTimeout
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.message import Message, definition, type_hash, type_name
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile
from proto import frames, limits
from proto.batches import MAX_HEAD_BYTES, BatchBuilder
from proto.codec import encode
from proto.publisher_queue import PublisherQueue

T = TypeVar("T", bound=Message)

LATCHED_MESSAGES: Final = 1000
"""What a KEEP_ALL + TRANSIENT_LOCAL publisher keeps for a broker restart, in messages."""


class Publisher(Entity, Generic[T]):
    """Publishes messages of one type on one topic. Made by `Node.create_publisher`.

    Attributes:
        topic_name: The full name of the topic.
        qos_profile: Its QoS.
        published: Messages published so far.
    """

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[T],
        topic: str,
        qos: QoSProfile,
        event_callbacks: PublisherEventCallbacks | None = None,
    ) -> None:
        self._codec: Codec[T] = codec_for(msg_type)
        events = PublisherEvents(context, topic, event_callbacks or PublisherEventCallbacks())
        super().__init__(context, events)
        self._events = events
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos
        self.gid = secrets.token_bytes(limits.INSTANCE_BYTES)
        resolved = qos.resolved()
        keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        self._latched = resolved.durability == DurabilityPolicy.TRANSIENT_LOCAL
        depth = max(1, resolved.depth)
        self._batch = BatchBuilder(0)
        self._queue = PublisherQueue(0, None if keep_all else depth)
        self._room = 0
        """Messages that may be published before the queue is checked again."""
        self._large = False
        """Whether the last message was large."""
        self._live = False
        self._refusal = ""
        """Why the broker of this session will not have it."""
        self._unlimited = True
        self._retained = Retained(LATCHED_MESSAGES if keep_all else depth)
        self._declared = 0
        """The number of the next message, as the last declaration had it."""
        self._qos_monitor = QoSMonitor(context, resolved, events)
        context.link.add(self)

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def published(self) -> int:
        """Messages published so far."""
        return self._batch.next_sequence + self._batch.length

    @property
    def dropped(self) -> int:
        """Messages dropped here, unsent: beyond KEEP_LAST's depth, or the broker refused the publisher."""
        return self._queue.dropped

    @property
    def queued(self) -> int:
        """Messages that wait here to be sent."""
        return self._queue.pending + self._batch.length

    def get_subscription_count(self) -> int:
        """Return how many subscriptions are matched now."""
        return self.peers

    def publish(self, msg: T | bytes) -> None:
        """Send a message to every subscription of the topic. Never blocks.

        The message is encoded, checked and numbered at once; it leaves at the end of this loop turn, together
        with what else was published. Bytes are taken as an already encoded message and are checked, too.

        Args:
            msg: The message.

        Raises:
            TypeError: Not a message of this publisher's type.
            InvalidMessageError: A field has a wrong type or is out of range, or the message is larger than
                the broker takes; nothing was sent.
            PublisherFull: KEEP_ALL only: the readers are slow and the queue is full. `await ready()` first.
            NodeDestroyed: The publisher has been destroyed.
        """
        if self._room <= 0:
            self._require_room()
        self._room -= 1
        if isinstance(msg, bytes):
            self._codec.decode(msg)
            self._collect(msg)
        elif self._large:
            self._publish_large(self._codec.encode_behind(msg, MAX_HEAD_BYTES))
        else:
            self._collect(self._codec.encode(msg))

    def _collect(self, data: bytes) -> None:
        """Put an encoded message into the run of this loop turn."""
        if len(data) > limits.BATCH_FLUSH_BYTES:
            self._publish_large(bytearray(MAX_HEAD_BYTES) + data)
            return
        batch = self._batch
        if batch.add(data):
            self.flush_turn()
            self.context.link.flush()
        elif batch.length == 1:
            self.context.link.flush_later(self)

    def _publish_large(self, buffer: bytearray) -> None:
        """A message that fills a run by itself goes alone; it lies in the buffer behind room for the head.

        After it the next one is expected to be as large, and encoded into such a buffer at once.
        """
        size = len(buffer) - MAX_HEAD_BYTES
        self._large = size > limits.BATCH_FLUSH_BYTES
        if not self._large:
            self._collect(bytes(memoryview(buffer)[MAX_HEAD_BYTES:]))
            return
        link = self.context.link
        link.require_fits(f"A message on '{self.topic_name}'", size)
        self.flush_turn()
        self._put(self._batch.single(buffer, self._queue.publisher, time.time_ns()))
        link.flush()

    def assert_liveliness(self) -> None:
        """Say that this publisher is alive, although it publishes nothing, so that its lease begins anew.

        Only a MANUAL_BY_TOPIC publisher has something to say; any other is alive while its node is.

        Raises:
            NodeDestroyed: The publisher has been destroyed.
        """
        self.require_alive()
        self._qos_monitor.shown()
        channel = self.context.link.channel
        if self._qos_monitor.by_hand and self._live and channel is not None:
            channel.send(frames.Assert(self._queue.publisher))

    def _require_room(self) -> None:
        """Look how many messages may be published before the next look; raise if none may."""
        self.require_alive()
        self._room = room.left(self._queue, self.queued)
        if not self._room:
            raise PublisherFull(
                f"'{self.topic_name}': {self.queued} messages wait for slow readers; await publisher.ready()"
            )

    @property
    def _crowded(self) -> bool:
        return room.crowded(self._queue, self.queued)

    def flush_turn(self) -> None:
        """Put what this loop turn published into the lane. Called by the link."""
        if not self._batch.length:
            return
        self._put(self._batch.take(self._queue.publisher, time.time_ns()))

    def _put(self, batch: frames.Batch) -> None:
        if self._latched:
            self._retained.add(batch)
        if self._qos_monitor.any:
            self._qos_monitor.published()
        channel = self.context.link.channel
        if self._live and channel is not None:
            channel.outbox.enqueue(self._queue, batch)
        else:
            self._queue.put(batch)
            self._queue.trim()
            if self._refusal:
                self._drop_unsent()
        if self._queue.pending_bytes >= room.KEEP_ALL_BYTES:
            self._room = 0

    async def ready(self, timeout_sec: float | None = None) -> None:
        """Wait until `publish` has room: with KEEP_LAST, until it would drop nothing.

        Returns at once, without a turn of the loop, when there is room.

        Raises:
            WaitTimeout: No room within `timeout_sec` (None: the node's default call timeout).
            PublisherRefused: The broker will not have this publisher.
        """
        if self._crowded:
            await self.context.wait_until(
                lambda: bool(self.destroyed or self._refusal or not self._crowded),
                f"Room to publish on '{self.topic_name}'",
                timeout_sec,
            )
        self.require_alive()
        if self._refusal:
            self._raise_refused()

    async def flush(self, timeout_sec: float | None = None) -> None:
        """Wait until everything published so far has reached the broker.

        Raises:
            WaitTimeout: It has not within `timeout_sec` (None: the node's default call timeout).
            BrokerUnreachable: The link broke while it was on its way.
            PublisherRefused: The broker will not have this publisher.
        """
        self.context.link.flush()
        loop = self.context.require_loop()
        limit = self.context.default_call_timeout_sec if timeout_sec is None else timeout_sec
        deadline = loop.time() + limit
        what = f"Flushing '{self.topic_name}'"
        await self.context.wait_until(
            lambda: bool(self._refusal or (self._live and self._queue.empty)), what, limit
        )
        if self._refusal:
            self._raise_refused()
        with in_flight():
            try:
                async with asyncio.timeout_at(deadline):
                    await self.context.link.round_trip()
            except TimeoutError as error:
                raise WaitTimeout(f"{what} did not come true within {limit:g} s") from error

    def destroy(self) -> None:
        """Take the publisher back, after everything it has published has been sent."""
        if self.destroyed:
            return
        self.flush_turn()
        self.destroyed = True
        self._qos_monitor.stop()
        if self.events is not None:
            self.events.stop()
        self._room = 0
        self.context.entities.pop(self, None)
        if self._live:
            self._leave()
            if self.context.link.channel is not None:
                self.context.departs(self._queue)
        elif self._queue.pending and (self.context.link.channel is not None or self.context.stopping):
            self.context.departs(self._queue)  # it is declared, and sends then
        else:
            self.context.report_unsent([self._queue])
            self.context.link.remove(self)
        self.context.link.wake()

    def _leave(self) -> None:
        """Send the UNDECLARE behind what waits in the lane."""
        link = self.context.link
        link.remove(self, announce=False)
        if self._unlimited or not self._queue.pending:
            link.publishers.pop(self._queue.publisher, None)  # no credit matters any more
        if link.channel is not None:
            link.channel.outbox.enqueue(self._queue, encode(frames.Undeclare(self.id)))
            link.flush_later(self)

    def diagnostics(self) -> PublisherDiagnostics:
        """Say how it is doing."""
        queue = self._queue
        credit = queue.sequence_limit
        if credit is not None:
            first = queue.first_sequence
            credit = max(0, credit - (self._batch.next_sequence if first is None else first))
        return PublisherDiagnostics(
            id=self.id,
            topic=self.topic_name,
            matched=self.peers,
            published=self.published,
            dropped=self.dropped,
            queued=self.queued,
            queued_bytes=queue.pending_bytes,
            queue_limit=room.limit(queue),
            credit=credit,
            events=self._events.diagnostics(),
        )

    # Endpoint

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the publisher; its numbers go on where an earlier link ended.

        What waits is sent for the first time: what was to be sent again has gone with the earlier link.
        """
        oldest = self._retained.first_sequence
        first = self._queue.first_sequence
        if first is None:
            first = self._batch.next_sequence
        self._declared = first if oldest is None else min(first, oldest)
        return frames.Publisher(
            self.id,
            self.context.id,
            self.topic_name,
            type_name(self.msg_type),
            type_hash(self.msg_type),
            self.qos_profile.to_wire(),
            self.gid,
            self._declared,
            definition(self.msg_type),
            first,
        )

    def accepted(self, number: int) -> None:
        """Endpoint: the broker has given the publisher its id; what waited may go."""
        link = self.context.link
        channel = link.channel
        if channel is None:
            return
        self._queue.restart(number, self._declared)
        self._drop_too_large()
        self._resend_retained()
        self._room = 0
        self._live = True
        self._unlimited = True
        self._qos_monitor.shown()
        link.publishers[number] = self
        channel.outbox.schedule(self._queue)
        if self.destroyed:
            self._leave()
        link.flush_later(self)

    def refused(self, code: int, text: str) -> None:
        """Endpoint: the broker will not have it. What waits is dropped: nothing would ever send it."""
        super().refused(code, text)
        self._refusal = text or "it does not say why"
        self.flush_turn()
        self._drop_unsent()
        if self.destroyed:
            self.context.link.remove(self, announce=False)
        self.context.link.wake()

    def _raise_refused(self) -> None:
        raise PublisherRefused(f"The broker refused to publish on '{self.topic_name}': {self._refusal}")

    def _drop_unsent(self) -> None:
        """Count what waits as dropped; only before anything has left."""
        self._queue.drop_larger(0)  # no message has 0 bytes

    def _drop_too_large(self) -> None:
        """Give up what this broker would close the link for."""
        largest = self.context.link.largest
        gone = self._queue.drop_larger(largest)
        if gone:
            self.context.log.error(
                f"'{self.topic_name}': dropped {gone} messages over the limit of {largest} bytes"
            )
        self._retained.drop_larger(largest)

    def _resend_retained(self) -> None:
        """Give a broker that does not have them the latched messages that had been sent before."""
        for batch in self._retained.newest_first(before=self._queue.first_sequence):
            self._queue.put_front(batch)

    def credit(self, frame: frames.Credit) -> None:
        """CREDIT came: what the slowest KEEP_ALL subscription allows."""
        channel = self.context.link.channel
        if channel is None:
            return
        if self.destroyed and self._queue.empty:
            # It has crossed the UNDECLARE: the broker knows this publisher no more.
            self.context.link.publishers.pop(frame.publisher, None)
            return
        if self._unlimited and frame.sequence_limit is not None:
            # Behind a run that has begun to leave, before all that the credit holds back.
            channel.outbox.enqueue(self._queue, encode(frame), first=True)
        self._unlimited = frame.sequence_limit is None
        self._queue.sequence_limit = frame.sequence_limit
        self._queue.byte_limit = frame.byte_limit
        channel.outbox.schedule(self._queue)
        self.context.link.flush_later(self)

    def link_lost(self) -> None:
        """Endpoint: back to queueing, KEEP_LAST to its depth."""
        super().link_lost()
        self._live = False
        self._refusal = ""  # the next broker may think differently
        self.context.link.publishers.pop(self._queue.publisher, None)
        self._queue.restart(0)
        self._queue.trim()
        self._room = 0
