"""Publishers: messages go into a run, runs into a lane, the lane to the broker as credit and room allow."""

from __future__ import annotations

import asyncio
import secrets
import time
from typing import Final, Generic, TypeVar

from actors.core import Core, Entity, in_flight
from actors.diagnostics import PublisherDiagnostics
from actors.entities import room
from actors.entities.promises import Promises
from actors.entities.retained import Retained
from actors.errors import PublisherFull, PublisherRefused, WaitTimeout
from actors.events import PublisherEventCallbacks, PublisherEvents
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.message import Message, definition, type_hash, type_name
from actors.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from proto import frames, limits
from proto.codec import encode
from proto.lane import Lane
from proto.runs import HEAD_ROOM, RunBuilder

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
        core: Core,
        msg_type: type[T],
        topic: str,
        qos: QoSProfile,
        event_callbacks: PublisherEventCallbacks | None = None,
    ) -> None:
        self._codec: Codec[T] = codec_for(msg_type)
        events = PublisherEvents(core, topic, event_callbacks or PublisherEventCallbacks())
        super().__init__(core, events)
        self._events = events
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos
        self.gid = secrets.token_bytes(limits.INSTANCE_BYTES)
        resolved = qos.resolved()
        self._keep_all = resolved.history == HistoryPolicy.KEEP_ALL
        self._latched = resolved.durability == DurabilityPolicy.TRANSIENT_LOCAL
        depth = max(1, resolved.depth)
        self._run = RunBuilder(0)
        self._lane = Lane(0, None if self._keep_all else depth)
        self._room = 0
        """Messages that may be published before somebody looks whether the queue is full."""
        self._large = False
        """Whether the last message was large."""
        self._live = False
        self._refusal = ""
        """Why the broker of this session will not have it."""
        self._unlimited = True
        self._retained = Retained(LATCHED_MESSAGES if self._keep_all else depth)
        self._declared = 0
        """The number of the next message, as the last declaration had it."""
        self._promises = Promises(core, resolved, events)
        core.link.add(self)

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def published(self) -> int:
        """Messages published so far."""
        return self._run.next_sequence + self._run.length

    @property
    def dropped(self) -> int:
        """Messages dropped here, unsent: beyond KEEP_LAST's depth, or the broker refused the publisher."""
        return self._lane.dropped

    @property
    def queued(self) -> int:
        """Messages that wait here to be sent."""
        return self._lane.pending + self._run.length

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
            self._publish_large(self._codec.encode_behind(msg, HEAD_ROOM))
        else:
            self._collect(self._codec.encode(msg))

    def _collect(self, data: bytes) -> None:
        """Put an encoded message into the run of this loop turn."""
        if len(data) > limits.RUN_FLUSH_BYTES:
            self._publish_large(bytearray(HEAD_ROOM) + data)
            return
        run = self._run
        if run.add(data):
            self.flush_turn()
            self.core.link.flush()
        elif run.length == 1:
            self.core.link.flush_later(self)

    def _publish_large(self, buffer: bytearray) -> None:
        """A message that fills a run by itself goes alone; it lies in the buffer behind room for the head.

        After it the next one is expected to be as large, and encoded into such a buffer at once.
        """
        size = len(buffer) - HEAD_ROOM
        self._large = size > limits.RUN_FLUSH_BYTES
        if not self._large:
            self._collect(bytes(memoryview(buffer)[HEAD_ROOM:]))
            return
        link = self.core.link
        link.require_fits(f"A message on '{self.topic_name}'", size)
        self.flush_turn()
        self._put(self._run.single(buffer, self._lane.publisher, time.time_ns()))
        link.flush()

    def assert_liveliness(self) -> None:
        """Say that this publisher is alive, although it publishes nothing, so that its lease begins anew.

        Only a MANUAL_BY_TOPIC publisher has something to say; any other is alive while its node is.

        Raises:
            NodeDestroyed: The publisher has been destroyed.
        """
        self.require_alive()
        self._promises.shown()
        channel = self.core.link.channel
        if self._promises.by_hand and self._live and channel is not None:
            channel.send(frames.Assert(self._lane.publisher))

    def _require_room(self) -> None:
        """Look how many messages may be published before the next look; raise if none may."""
        self.require_alive()
        self._room = room.left(self._lane, self.queued)
        if not self._room:
            raise PublisherFull(
                f"'{self.topic_name}': {self.queued} messages wait for slow readers; await publisher.ready()"
            )

    @property
    def _crowded(self) -> bool:
        return room.crowded(self._lane, self.queued)

    def flush_turn(self) -> None:
        """Put what this loop turn published into the lane. Called by the link."""
        if not self._run.length:
            return
        self._put(self._run.take(self._lane.publisher, time.time_ns()))

    def _put(self, run: frames.Run) -> None:
        if self._keep_all:
            self._room = 0  # what waits has grown: look again
        if self._latched:
            self._retained.add(run)
        if self._promises.any:
            self._promises.published()
        channel = self.core.link.channel
        if self._live and channel is not None:
            channel.outbox.put_lane(self._lane, run)
        else:
            self._lane.put(run)
            self._lane.trim()
            if self._refusal:
                self._drop_unsent()

    async def ready(self, timeout_sec: float | None = None) -> None:
        """Wait until `publish` has room: with KEEP_LAST, until it would drop nothing.

        Returns at once, without a turn of the loop, when there is room.

        Raises:
            WaitTimeout: No room within `timeout_sec` (None: the node's default call timeout).
            PublisherRefused: The broker will not have this publisher.
        """
        if self._crowded:
            await self.core.wait_until(
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
        self.core.link.flush()
        loop = self.core.require_loop()
        limit = self.core.default_call_timeout_sec if timeout_sec is None else timeout_sec
        deadline = loop.time() + limit
        what = f"Flushing '{self.topic_name}'"
        await self.core.wait_until(
            lambda: bool(self._refusal or (self._live and self._lane.empty)), what, limit
        )
        if self._refusal:
            self._raise_refused()
        with in_flight():
            try:
                async with asyncio.timeout_at(deadline):
                    await self.core.link.round_trip()
            except TimeoutError as error:
                raise WaitTimeout(f"{what} did not come true within {limit:g} s") from error

    def destroy(self) -> None:
        """Take the publisher back, after everything it has published has been sent."""
        if self.destroyed:
            return
        self.flush_turn()
        self.destroyed = True
        self._promises.stop()
        if self.events is not None:
            self.events.stop()
        self._room = 0
        self.core.entities.pop(self, None)
        if self._live:
            self._leave()
            if self.core.link.channel is not None:
                self.core.departs(self._lane)
        elif self.core.link.channel is None or not self._lane.pending:
            if self._lane.pending:
                self.core.log.warning(
                    f"'{self.topic_name}': {self._lane.pending} messages were never sent: no broker"
                )
            self.core.link.remove(self)
        else:
            self.core.departs(self._lane)
        self.core.link.wake()

    def _leave(self) -> None:
        """Send the UNDECLARE behind what waits in the lane."""
        link = self.core.link
        link.remove(self, announce=False)
        if self._unlimited or not self._lane.pending:
            link.publishers.pop(self._lane.publisher, None)  # no credit matters any more
        if link.channel is not None:
            link.channel.outbox.put_lane(self._lane, encode(frames.Undeclare(self.id)))
            link.flush_later(self)

    def diagnostics(self) -> PublisherDiagnostics:
        """Say how it is doing."""
        lane = self._lane
        credit = lane.sequence_limit
        if credit is not None:
            first = lane.first_sequence
            credit = max(0, credit - (self._run.next_sequence if first is None else first))
        return PublisherDiagnostics(
            id=self.id,
            topic=self.topic_name,
            matched=self.peers,
            published=self.published,
            dropped=self.dropped,
            queued=self.queued,
            queued_bytes=lane.pending_bytes,
            queue_limit=room.limit(lane),
            credit=credit,
            events=self._events.diagnostics(),
        )

    # Endpoint

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the publisher; its numbers go on where an earlier link ended.

        What waits is sent for the first time: what was to be sent again has gone with the earlier link.
        """
        oldest = self._retained.first_sequence
        first = self._lane.first_sequence
        if first is None:
            first = self._run.next_sequence
        self._declared = first if oldest is None else min(first, oldest)
        return frames.Publisher(
            self.id,
            self.core.id,
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
        link = self.core.link
        channel = link.channel
        if channel is None:
            return
        self._lane.restart(number, self._declared)
        self._drop_too_large()
        self._resend_retained()
        self._live = True
        self._unlimited = True
        self._promises.shown()
        link.publishers[number] = self
        channel.outbox.wake(self._lane)
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
            self.core.link.remove(self, announce=False)
        self.core.link.wake()

    def _raise_refused(self) -> None:
        raise PublisherRefused(f"The broker refused to publish on '{self.topic_name}': {self._refusal}")

    def _drop_unsent(self) -> None:
        """Count what waits as dropped; only before anything has left."""
        self._lane.drop_larger(0)  # no message has 0 bytes

    def _drop_too_large(self) -> None:
        """Give up what this broker would close the link for."""
        largest = self.core.link.largest
        gone = self._lane.drop_larger(largest)
        if gone:
            self.core.log.error(
                f"'{self.topic_name}': dropped {gone} messages over the limit of {largest} bytes"
            )
        self._retained.drop_larger(largest)

    def _resend_retained(self) -> None:
        """Give a broker that does not have them the latched messages that had been sent before."""
        for run in self._retained.newest_first(before=self._lane.first_sequence):
            self._lane.put_front(run)

    def credit(self, frame: frames.Credit) -> None:
        """CREDIT came: what the slowest KEEP_ALL subscription allows."""
        channel = self.core.link.channel
        if channel is None:
            return
        if self.destroyed and self._lane.empty:
            # It has crossed the UNDECLARE: the broker knows this publisher no more.
            self.core.link.publishers.pop(frame.publisher, None)
            return
        if self._unlimited and frame.sequence_limit is not None:
            # Behind a run that has begun to leave, before all that the credit holds back.
            channel.outbox.put_lane(self._lane, encode(frame), first=True)
        self._unlimited = frame.sequence_limit is None
        self._lane.sequence_limit = frame.sequence_limit
        self._lane.byte_limit = frame.byte_limit
        channel.outbox.wake(self._lane)
        self.core.link.flush_later(self)

    def link_lost(self) -> None:
        """Endpoint: back to queueing, KEEP_LAST to its depth."""
        super().link_lost()
        self._live = False
        self._refusal = ""  # the next broker may think differently
        self.core.link.publishers.pop(self._lane.publisher, None)
        self._lane.restart(0)
        self._lane.trim()
