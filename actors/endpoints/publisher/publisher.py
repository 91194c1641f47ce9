"""The publisher as users hold it."""

from __future__ import annotations

from operator import index
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from actors.endpoints.context import in_flight, time_limit
from actors.endpoints.endpoint import Handle
from actors.endpoints.publisher.endpoint import PublisherEndpoint
from actors.errors import PublisherRefused, WaitTimeout
from actors.interfaces.codec import FIXMAP, Codec, codec_for, encoded_message
from actors.interfaces.message import Message
from actors.time.timeout import DEFAULT_TIMEOUT
from proto.queues.batches import MAX_HEAD_BYTES
from proto.wire import frames

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import PublisherEventCallbacks
    from actors.qos.profile import QoSProfile
    from actors.time.timeout import Timeout

T = TypeVar("T", bound=Message)

MAX_STAMP_NS: Final = 2**63 - 1
"""The latest timestamp of a message: in 2262, as in ROS 2, whose clocks count in signed 64 bits."""


class Publisher(Handle[PublisherEndpoint], Generic[T]):
    """Publishes messages of one type on one topic. Made by `Node.create_publisher`.

    Attributes:
        msg_type: The message class.
        topic_name: The full name of the topic.
        qos_profile: Its QoS.
        gid: 16 bytes that identify the publisher, also across reconnects: `MessageInfo.publisher_gid` of its
            messages. Brokers derive them from a secret of the node, so no other node can use the same.
    """

    def __init__(
        self,
        context: NodeContext,
        msg_type: type[T],
        topic: str,
        qos: QoSProfile,
        event_callbacks: PublisherEventCallbacks | None = None,
        *,
        strict_qos: bool | None = None,
    ) -> None:
        self._codec: Codec[T] = codec_for(msg_type)
        super().__init__(
            PublisherEndpoint(context, msg_type, topic, qos, event_callbacks, strict_qos=strict_qos)
        )
        self.msg_type = msg_type
        self.topic_name = topic
        self.qos_profile = qos
        self.gid = self._endpoint.gid

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return self.topic_name

    @property
    def published(self) -> int:
        """Messages published so far."""
        return self._endpoint.published

    @property
    def dropped(self) -> int:
        """Messages dropped here, unsent: beyond KEEP_LAST's depth, or the broker refused the publisher."""
        return self._endpoint.queue.dropped

    @property
    def queued(self) -> int:
        """Messages that wait here to be sent."""
        return self._endpoint.queued

    def get_subscription_count(self) -> int:
        """Return how many subscriptions are matched now.

        Returns:
            The number of matched subscriptions; 0 without a broker.
        """
        return self._endpoint.peers

    async def wait_for_subscriptions(self, count: int = 1, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until at least `count` subscriptions are matched.

        Args:
            count: The number of subscriptions.
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            WaitTimeout: There were fewer for `timeout_sec`.
            PublisherRefused: The broker has refused this publisher.
            RuntimeError: The node does not run.
            NodeDestroyed: The publisher or the node has been destroyed.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        missing = "no subscription" if count == 1 else f"fewer than {count} subscriptions"
        await endpoint.context.wait_until(
            lambda: bool(endpoint.destroyed or endpoint.refusal or endpoint.peers >= count),
            f"'{self.topic_name}' has {missing}",
            timeout_sec,
        )
        endpoint.require_alive()
        self._require_accepted()

    def publish(self, msg: T | bytes) -> None:
        """Send a message to every subscription of the topic. Never blocks.

        The message is encoded, checked and numbered at once; it leaves at the end of this loop turn, together
        with what else was published. Bytes are taken as an already encoded message and are checked, too:
        `publish_encoded` does not check them.

        Args:
            msg: The message.

        Raises:
            TypeError: Not a message of this publisher's type.
            InvalidMessageError: A field has a wrong type or is out of range, or the message is larger than
                the broker takes; nothing was sent.
            PublisherFull: KEEP_ALL only: the readers are slow and the queue is full. `await ready()` first.
            NodeDestroyed: The publisher has been destroyed.
        """
        # The hot path. The three questions here are those whose answers change between two messages; all
        # others (the session, credit, the depth) are asked once for the batch, when the turn ends.
        endpoint = self._endpoint
        if endpoint.space <= 0:
            endpoint.require_space()
        endpoint.space -= 1
        if isinstance(msg, bytes):
            self._codec.decode(msg)
            endpoint.collect_encoded(msg)
        elif endpoint.large:
            if endpoint.shares:
                endpoint.collect_large(self._codec.encode(msg), 0)
            else:
                endpoint.collect_large(self._codec.encode_behind(msg, MAX_HEAD_BYTES))
        else:
            endpoint.collect(self._codec.encode(msg))

    def publish_encoded(self, data: Buffer, source_timestamp_ns: int | None = None) -> None:
        """Send a message that is already encoded, as `publish` does, without decoding it.

        For recorders and bridges, which have received the bytes from a subscription with `raw=True`. Bytes
        that are not a message of this publisher's type are dropped by subscriptions, as `undecodable`.

        A message that keeps the time when it was first published gets older on its way: its lifespan is
        counted from then, by readers and for latched messages, and so are the delays that tools show.
        Deadlines and leases ask when messages are sent and received. If the publisher has a lifespan or is
        TRANSIENT_LOCAL, messages with different times travel in frames of their own, which costs more than
        one frame for all messages of a turn of the loop.

        Args:
            data: One message as msgpack: a map. It is copied.
            source_timestamp_ns: When it was published, in ns since the epoch, from 0 to 2**63 - 1:
                `MessageInfo.source_timestamp` of its receivers. None is the time of sending.

        Raises:
            TypeError: `data` is not bytes, or the timestamp not an int.
            ValueError: The timestamp is out of range; nothing was sent.
            InvalidMessageError: It is no msgpack map, or larger than the broker takes; nothing was sent.
            PublisherFull, NodeDestroyed: As for `publish`.
        """
        message: Any = data
        # Most messages are bytes and have few fields; for them the call would cost a fifth of all this.
        if not isinstance(data, bytes) or not data or data[0] >> 4 != FIXMAP:
            message = encoded_message(data)
        endpoint = self._endpoint
        if source_timestamp_ns is not None:
            endpoint.collect_stamped(message, _checked_stamp(source_timestamp_ns))
            return
        if endpoint.space <= 0:
            endpoint.require_space()
        endpoint.space -= 1
        endpoint.collect_encoded(message)

    def assert_liveliness(self) -> None:
        """Assert that this publisher is alive, although it publishes nothing, so that its lease begins again.

        Only a MANUAL_BY_TOPIC publisher needs that; any other is alive while its node is.

        Raises:
            NodeDestroyed: The publisher has been destroyed.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        endpoint.context.link.require_thread()
        if endpoint.qos_monitor is not None:
            endpoint.qos_monitor.asserted()
        channel = endpoint.context.link.channel
        if endpoint.manual and endpoint.accepted_now and channel is not None:
            channel.send(frames.Assert(endpoint.queue.publisher))

    async def ready(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until the publisher's queue has space: with KEEP_LAST, until `publish` would drop nothing.

        Returns at once, without a turn of the loop, when there is space.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            WaitTimeout: There was no space within `timeout_sec`.
            PublisherRefused: The broker has refused this publisher.
            RuntimeError: There is no space, and the node does not run.
            NodeDestroyed: The publisher has been destroyed.
        """
        endpoint = self._endpoint
        if endpoint.crowded:
            await endpoint.context.wait_until(
                lambda: bool(endpoint.destroyed or endpoint.refusal or not endpoint.crowded),
                f"The queue of '{self.topic_name}' is still full",
                timeout_sec,
            )
        endpoint.require_alive()
        self._require_accepted()

    async def flush(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until everything published so far has reached the broker.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            WaitTimeout: It did not reach the broker within `timeout_sec`.
            BrokerUnreachable: The link broke while it was on its way.
            PublisherRefused: The broker has refused this publisher.
            RuntimeError: The node does not run.
            NodeDestroyed: The publisher or the node has been destroyed.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        context, link = endpoint.context, endpoint.context.link
        loop = context.require_loop()
        link.flush()
        limit = context.limit_sec(timeout_sec)
        deadline = loop.time() + limit
        failure = f"Messages on '{self.topic_name}' have not reached the broker"
        await context.wait_until(
            lambda: bool(
                endpoint.destroyed or endpoint.refusal or (endpoint.accepted_now and endpoint.queue.empty)
            ),
            failure,
            limit,
        )
        endpoint.require_alive()
        self._require_accepted()
        with in_flight():
            try:
                async with time_limit(deadline - loop.time()):
                    await link.round_trip()
            except TimeoutError as error:
                raise WaitTimeout(f"{failure} after {limit:g} s") from error

    def _require_accepted(self) -> None:
        """Raise PublisherRefused if the broker of this session has refused the publisher."""
        if refusal := self._endpoint.refusal:
            raise PublisherRefused(f"The broker refused to publish on '{self.topic_name}': {refusal}")

    def destroy(self) -> None:
        """Take the publisher out of service, after everything it has published has been sent."""
        self._endpoint.destroy()


def _checked_stamp(stamp_ns: int) -> int:
    """Return a timestamp as an int; raise TypeError or ValueError if it is not valid."""
    number = index(stamp_ns)
    if not 0 <= number <= MAX_STAMP_NS:
        raise ValueError(f"source_timestamp_ns must be from 0 to 2**63 - 1, not {number}")
    return number
