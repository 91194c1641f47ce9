"""The topics that one client reads, and those that it publishes on."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import type_name
from actors.qos.profile import DurabilityPolicy, QoSProfile
from actors.web.rosbridge.cbor import require_cbor
from actors.web.rosbridge.encoding import publish_frame
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.peer import full_name, full_type, require_room
from actors.web.rosbridge.topic_output import TopicOutput
from actors.web.send_queue import SendQueue
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.publisher.publisher import Publisher
    from actors.graph.snapshot import GraphSnapshot
    from actors.web.rosbridge.operations import Advertise, Id, Publish, Subscribe, Unadvertise, Unsubscribe
    from actors.web.rosbridge.outbox import Outbox
    from actors.web.rosbridge.peer import Peer
    from actors.web.topic_feed import Received, TopicListener

MAX_TOPICS: Final = 1000
"""Topics that a client reads, and as many on which it publishes."""

DEPTH: Final = 100
"""Depth of a publisher, unless the client asks for another one: as rosbridge_suite's."""

MAX_DEPTH: Final = 1000

MESSAGES_PER_TURN: Final = 32
"""Messages that are sent before replies have their turn."""

_TOPIC_KINDS: Final = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)


@dataclass(slots=True)
class _Read:
    """A topic that the client reads.

    Attributes:
        listener: Gets its messages.
        output: Decides how they are sent, and which wait for a throttle.
        wanted: The type that the client has given; else empty.
        decode: Decodes messages of the topic's type; None if that is not known yet.
        kind: That type.
        asked: The graph when the type was looked up last.
        reported: Whether the client knows that a message could not be sent.
    """

    listener: TopicListener
    output: TopicOutput[Received]
    wanted: str
    decode: Callable[[bytes], Any] | None = None
    kind: str = ""
    asked: GraphSnapshot | None = None
    reported: bool = False


class ReadTopics:
    """The topics that one client reads.

    Args:
        peer: The client.
        outbox: Sends to it.
        count_drops: Called with how many messages the client did not get because it is too slow. Those that
            make room because of a throttle do not count: the client has asked for that.
    """

    def __init__(self, peer: Peer, outbox: Outbox, count_drops: Callable[[int], object]) -> None:
        self._peer, self._outbox, self._count_drops = peer, outbox, count_drops
        self._topics: dict[str, _Read] = {}
        """By the text with which the client names the topic: it knows no other."""
        self._queue = SendQueue[str, "Received"]()
        self._throttled: dict[str, None] = {}
        """Topics with a message that waits for its time."""
        self._refused: dict[str, None] = {}
        """Topics whose subscription the broker has refused."""

    async def subscribe(self, request: Subscribe) -> None:
        """Begin to read a topic, or add a subscription.

        Raises:
            OperationError: The topic has another type, there are too many, or CBOR is missing.
            CallboardError: See `TopicFeeds.listen`.
        """
        if request.compression in {"cbor", "cbor-raw"}:
            require_cbor()
        name, text = full_name(request.topic), request.topic
        wanted = full_type(request.type, "msg") if request.type else ""
        if wanted:
            _require_type(await self._peer.workspace.observer.newest_around(name), name, wanted)
        before = self._topics.get(text)
        if before is None:
            require_room(len(self._topics), MAX_TOPICS, "topics to read")
            self._queue.open(text)
        elif before.output.is_full:
            raise OperationError("A client may not have more subscriptions to one topic")
        output = TopicOutput["Received"]() if before is None else before.output
        try:
            # Also for a further subscription: its part of the client wants the latched messages, too.
            listener = self._peer.workspace.feeds.listen(
                name, partial(self._receive, text), partial(self._refuse, text), wanted
            )
        except CallboardError:
            if before is None:
                self._queue.close(text)
            raise
        if before is not None:
            before.listener.close()
        self._topics[text] = _Read(listener, output, wanted)
        output.subscribe(request)
        self._queue.set_limit(text, output.limit)

    def unsubscribe(self, request: Unsubscribe) -> None:
        """End a subscription, or all to a topic.

        Raises:
            OperationError: There is none.
        """
        found = self._topics.get(request.topic)
        if found is None or not found.output.unsubscribe(request.id):
            raise OperationError(f"There is no subscription to '{request.topic}' with this id")
        if not found.output:
            self._close(request.topic)
        else:
            self._queue.set_limit(request.topic, found.output.limit)

    def close(self) -> None:
        """Read nothing any more."""
        for text in tuple(self._topics):
            self._close(text)

    async def send(self) -> float | None:
        """Send some of what waits.

        Returns:
            The seconds until there is more to send; None if nothing waits.
        """
        self._report()
        for _ in range(MESSAGES_PER_TURN):
            if not self._queue:
                break
            text, received = self._queue.pop()
            if self._topics[text].output.throttle_sec:
                self._topics[text].output.add(received)
                self._throttled[text] = None
            else:
                await self._send(text, received)
        now_sec = asyncio.get_running_loop().time()
        for text in tuple(self._throttled):
            await self._send_throttled(text, now_sec)
        times = [self._topics[text].output.next_sec - now_sec for text in self._throttled]
        return 0 if self._queue else min(times, default=None)

    async def _send_throttled(self, text: str, now_sec: float) -> None:
        found = self._topics.get(text)  # the client may have unsubscribed while another topic was sent
        received = None if found is None else found.output.pop(now_sec)
        if received is not None:
            await self._send(text, received)
        if found is None or not found.output.waiting:
            self._throttled.pop(text, None)

    async def _send(self, text: str, received: Received) -> None:
        found = self._topics[text]
        compression = found.output.compression
        try:
            decode = await self._decoder(text, found, received.info.publisher_node)
            frame = await publish_frame(received, decode, text, compression, self._peer.workspace.work)
        except CallboardError as error:
            self._count_drops(1)
            if not found.reported:
                found.reported = True
                self._peer.status("error", f"A message of '{text}' cannot be sent: {error}")
            return
        is_binary = compression in {"cbor", "cbor-raw"}
        await self._outbox.send(frame, found.output.fragment_size, binary=is_binary)

    async def _decoder(self, text: str, found: _Read, node: str) -> Callable[[bytes], Any]:
        """Return what decodes a node's messages: by the topic's type, also one that is not installed here."""
        workspace, decode_any = self._peer.workspace, found.listener.decode
        name, snapshot = full_name(text), workspace.observer.snapshot
        # The topic may have got another type, as which the bytes would make sense, too.
        if found.decode is not None and found.kind in found.listener.types_of(node):
            return found.decode
        if found.asked is snapshot:
            return found.decode or decode_any
        found.asked, found.decode = snapshot, None
        try:
            # The newest graph: a message may come before the news of its publisher.
            newest = await workspace.observer.newest_around(name)
            msg_type = await workspace.types.message(newest, name, found.wanted)
            decode_one = codec_for(msg_type).decode
        except CallboardError:  # it has several types, or none
            return decode_any

        def decode(data: bytes) -> Any:
            try:
                return decode_one(data)
            except InvalidMessageError:  # from a new publisher with another type
                return decode_any(data)

        found.decode, found.kind = decode, type_name(msg_type)
        return decode

    def _report(self) -> None:
        """Tell the client about refused subscriptions, and about messages that it has not got."""
        for text in self._refused:
            if (found := self._topics.get(text)) is not None:
                self._peer.status("error", f"subscribe: {found.listener.refusal}")
                self._close(text)
        self._refused.clear()
        drops = self._queue.drops
        for text, count in drops.items():
            self._count_drops(count)
            self._peer.status("warning", f"{count} messages of '{text}' were dropped: the client is too slow")
        drops.clear()

    def _receive(self, text: str, received: Received, source: bytes) -> None:
        found = self._topics.get(text)  # None for the latched messages that come at once
        if found is not None and found.listener.skipped:
            self._queue.drops[text] += found.listener.skipped
            found.listener.skipped = 0
        self._queue.add(text, received, len(received.data), source)
        self._outbox.wake()

    def _refuse(self, text: str) -> None:
        self._refused[text] = None
        self._outbox.wake()

    def _close(self, text: str) -> None:
        self._topics.pop(text).listener.close()
        self._queue.close(text)
        self._throttled.pop(text, None)


@dataclass(slots=True)
class _Advertised:
    """A topic on which the client publishes.

    Attributes:
        publisher: Its publisher.
        ids: Of the operations that have advertised it.
    """

    publisher: Publisher[Any]
    ids: set[Id] = field(default_factory=set["Id"])


class PublishedTopics:
    """The topics on which one client publishes.

    Args:
        peer: The client.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._topics: dict[str, _Advertised] = {}

    async def advertise(self, request: Advertise) -> None:
        """Make a publisher.

        Raises:
            OperationError: The topic has another type, or there are too many.
            CallboardError: The type is not known, the name is not valid, or there is no broker now.
        """
        latched, depth = bool(request.latch), request.queue_size
        wanted = full_type(request.type, "msg")
        found = await self._publisher(full_name(request.topic), wanted, latched=latched, depth=depth)
        require_room(len(found.ids), MAX_TOPICS, "advertisements of one topic")
        found.ids.add(request.id)

    def unadvertise(self, request: Unadvertise) -> None:
        """Destroy a publisher, if nothing else has advertised it.

        Raises:
            OperationError: There is none.
        """
        name = full_name(request.topic)
        found = self._topics.get(name)
        if found is None:
            raise OperationError(f"This client has not advertised '{request.topic}'")
        found.ids.discard(request.id)
        if request.id is None or not found.ids:
            del self._topics[name]
            found.publisher.destroy()

    async def publish(self, request: Publish, size: int) -> None:
        """Publish a message, on a topic of the graph also if it has not been advertised.

        Args:
            request: The message.
            size: The bytes of its frame.

        Raises:
            OperationError: There are too many topics.
            CallboardError: The message does not fit, the topic is not known, or it is not allowed.
        """
        name = full_name(request.topic)
        found = self._topics.get(name)
        if found is None:
            found = await self._publisher(name, "", latched=bool(request.latch), depth=None)
        publisher = found.publisher
        publisher.publish_encoded(await self._peer.encoded(publisher.msg_type, request.msg, size))

    async def _publisher(self, name: str, wanted: str, *, latched: bool, depth: int | None) -> _Advertised:
        found = self._topics.get(name)
        if found is None:
            require_room(len(self._topics), MAX_TOPICS, "topics to publish on")
            workspace = self._peer.workspace
            snapshot = await workspace.observer.newest_around(name)
            _require_type(snapshot, name, wanted)
            msg_type = await workspace.types.message(snapshot, name, wanted)
            profile = QoSProfile(
                depth=1 if latched else min(depth or DEPTH, MAX_DEPTH),
                durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
            )
            publisher: Publisher[Any] = self._peer.node.create_publisher(msg_type, name, profile)
            await self._peer.require_accepted(publisher)
            found = self._topics[name] = _Advertised(publisher)
        elif wanted and (known := type_name(found.publisher.msg_type)) != wanted:
            raise OperationError(f"This client has advertised '{name}' with the type {known}")
        return found


def _require_type(part: GraphSnapshot, name: str, wanted: str) -> None:
    types = {each.type_name for each in part.of_kind(*_TOPIC_KINDS) if each.name == name} - {""}
    if wanted and types and wanted not in types:
        raise OperationError(f"'{name}' has the type {', '.join(sorted(types))}, not {wanted}")
