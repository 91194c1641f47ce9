"""Topics for browsers: one subscription a topic, however many read it; slow readers get the newest."""

from __future__ import annotations

import asyncio
from collections import deque
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.endpoints.subscription.sequence_tracker import REMEMBERED_PUBLISHERS
from actors.interfaces.errors import InvalidMessageError
from actors.qos.profile import DurabilityPolicy
from actors.tools.generic_subscription import decoder_of, profile_of
from actors.web.subscription_answer import SubscriptionAnswer
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Hashable, Iterator

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.endpoints.subscription.subscription import Subscription
    from actors.graph.snapshot import GraphSnapshot
    from actors.qos.profile import QoSProfile
    from actors.web.observer import Observer

DEPTH: Final = 1000
"""Messages that wait for this process at most."""

MAX_TOPICS: Final = 2048
"""Topics that are read at the same time: all of a large robot, by a live tool."""

MAX_BYTES: Final = 16 * 1024 * 1024
"""Limit on the messages that wait for a reader, and on latched ones for later readers; the newest is kept.
Also of a message whose fields are shown."""


class TooManyTopicsError(CallboardError):
    """The server reads `MAX_TOPICS` topics already. Close one."""


class _Received(NamedTuple):
    data: bytes
    info: MessageInfo


class Received(_Received):
    """A message as it was received.

    Attributes:
        data: Its bytes.
        info: Its metadata.
    """

    @cached_property
    def forms(self) -> dict[Hashable, bytes]:
        """It in other encodings: who needs one first makes it, for all readers."""
        return {}


class NewestMessages:
    """A queue that drops its oldest messages beyond its limits.

    Args:
        limit: Messages at most; `MAX_BYTES` is the other limit.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._messages: deque[Received] = deque()
        self._bytes = 0

    def add(self, received: Received) -> int:
        """Add a message; return how many were dropped for it."""
        messages, dropped = self._messages, 0
        messages.append(received)
        self._bytes += len(received.data)
        # The newest is kept whatever its size: otherwise a topic of large images would show nothing.
        while len(messages) > self._limit or (self._bytes > MAX_BYTES and len(messages) > 1):
            self._bytes -= len(messages.popleft().data)
            dropped += 1
        return dropped

    def clear(self) -> None:
        """Drop all."""
        self._messages.clear()
        self._bytes = 0

    def __iter__(self) -> Iterator[Received]:
        """Return the messages, oldest first."""
        return iter(self._messages)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._messages)


class TopicListener:
    """Hands one topic's messages to a function as they come, each once.

    Args:
        feed: The topic.
        receive: Called with each message, and with its publisher if the topic is latched, else with nothing.
        refused: Called when the broker has refused the subscription.
        kind: The type of the messages; empty for all types.

    Attributes:
        wake: `refused`.
        skipped: Messages lost on their way since it was last set to 0.
    """

    def __init__(
        self,
        feed: TopicFeed,
        receive: Callable[[Received, bytes], object],
        refused: Callable[[], None],
        kind: str,
    ) -> None:
        self._feed = feed
        self._receive = receive
        self._kind = kind
        self._next: dict[bytes, int] = {}
        """The number after the newest message, by publisher."""
        self.wake = refused
        self.skipped = 0

    @property
    def refusal(self) -> str:
        """Why the broker refuses the subscription; "" if it does not."""
        return self._feed.refusal

    def add(self, received: Received) -> None:
        """Hand on a message, if it is of the listener's type and not one that it has had."""
        info, known = received.info, self._next
        number, publisher = info.publication_sequence_number, info.publisher_gid
        if self._kind and not self._feed.may_publish(info.publisher_node, self._kind):
            return
        # A subscription that replaces another one gets latched messages again.
        if number < known.get(publisher, 0):
            return
        known.pop(publisher, None)  # last, so that those that have sent nothing for long are forgotten
        known[publisher] = number + 1
        if len(known) > REMEMBERED_PUBLISHERS:
            del known[next(iter(known))]
        self._receive(received, publisher if self._feed.is_latched else b"")

    def types_of(self, node: str) -> Collection[str]:
        """Return the types of a node's publishers of the topic; none if the node is new.

        Args:
            node: Its full name.
        """
        return self._feed.types_of(node)

    async def accepted(self) -> None:
        """Wait until the broker has answered the subscription, or cannot be reached.

        Raises:
            SubscriptionRefusedError: It refuses it.
        """
        await self._feed.answer.accepted()

    def decode(self, data: bytes, most: int = MAX_BYTES) -> Any:
        """Return a message as an instance of its class, or as a dict. A thread may call it.

        Args:
            data: Its bytes.
            most: How many there may be.

        Raises:
            InvalidMessageError: The bytes are not a message of the type, or too many.
        """
        if len(data) > most:
            raise InvalidMessageError(f"The message has {len(data)} bytes; those of up to {most} are shown")
        return self._feed.decode(data)

    def close(self) -> None:
        """Stop listening."""
        self._feed.remove(self)


class TopicReader(TopicListener):
    """One reader's newest messages of a topic.

    Args:
        feed: The topic.
        kept: How many messages wait for the reader at most.
        wake: Called when there are messages to pop.
        kind: The type of the messages; empty for all types.

    Attributes:
        wake: As given.
        skipped: Messages dropped here, or lost on their way, since it was last set to 0.
    """

    def __init__(self, feed: TopicFeed, kept: int, wake: Callable[[], None], kind: str) -> None:
        super().__init__(feed, self._queue, wake, kind)
        self._waiting = NewestMessages(kept)

    def _queue(self, received: Received, _: bytes) -> None:
        if not self._waiting:  # otherwise the reader has been woken, and has not come yet
            self.wake()
        self.skipped += self._waiting.add(received)

    def pop(self) -> list[Received]:
        """Return the messages since the last call.

        Raises:
            SubscriptionRefusedError: The broker refuses the subscription.
        """
        self._feed.answer.require_accepted()
        taken = [*self._waiting]
        self._waiting.clear()
        return taken


class TopicFeed:
    """One topic, its subscription, and its readers.

    Args:
        observer: Has the node and the graph.
        topic: The topic's full name.
        unused: Called when the last reader has gone.

    Attributes:
        answer: Whether the broker accepts the subscription.
    """

    def __init__(self, observer: Observer, topic: str, unused: Callable[[], None]) -> None:
        self._observer = observer
        self._topic = topic
        self._unused = unused
        self._readers: list[TopicListener] = []
        self._decoder: tuple[GraphSnapshot, Callable[[bytes], Any]] | None = None
        """Decodes messages, by the types of this graph."""
        self._types: dict[str, set[str]] | None = None
        """The types of the publishers of each node; None until they are needed after a change of the
        graph."""
        self._subscribe(profile_of(observer.around(topic), topic, depth=DEPTH))
        self._end_watch = observer.on_graph(self._update_subscription)  # after what may raise
        self.answer = SubscriptionAnswer(observer.node, lambda: self._subscription, self._wake)

    def _wake(self) -> None:
        for reader in self._readers:
            reader.wake()

    def _subscribe(self, profile: QoSProfile) -> None:
        self._profile = profile
        latched = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        self._latched = NewestMessages(DEPTH) if latched else None
        self._subscription: Subscription[Any] = self._observer.node.create_subscription(
            None, self._topic, self._receive, profile, raw=True
        )
        self._lost = 0

    @property
    def is_latched(self) -> bool:
        """Whether all publishers keep messages for late joiners."""
        return self._latched is not None

    @property
    def refusal(self) -> str:
        """Why the broker refuses the subscription; "" if it does not."""
        return self._subscription.refusal

    def add(self, reader: TopicListener) -> None:
        """Add a reader."""
        self._readers.append(reader)
        for received in self._latched or ():
            reader.add(received)
        if self.refusal:  # `answer` has woken those before; this one is not known to its owner yet
            asyncio.get_running_loop().call_soon(reader.wake)

    def remove(self, reader: TopicListener) -> None:
        """Remove a reader; without any the subscription ends."""
        if reader not in self._readers:
            return
        self._readers.remove(reader)
        if not self._readers:
            self._end_watch()
            self.answer.close()
            self._observer.node.destroy_subscription(self._subscription)
            self._unused()

    def decode(self, data: bytes) -> Any:
        """Decode a message; see `TopicReader.decode`."""
        snapshot, found = self._observer.snapshot, self._decoder
        if found is None or found[0] is not snapshot:
            # Of the graph before: if the event loop replaces it meanwhile, this decoder is used once.
            found = self._decoder = snapshot, decoder_of(self._observer.around(self._topic), self._topic)
        return found[1](data)

    def may_publish(self, node: str, kind: str) -> bool:
        """Return whether a node has a publisher of a type, or is new: messages do not name their type."""
        types = self.types_of(node)
        return not types or kind in types

    def types_of(self, node: str) -> Collection[str]:
        """See `TopicListener.types_of`."""
        if self._types is None:
            self._types = {}
            for entry in self._observer.around(self._topic).of_kind(EntryKind.PUBLISHER):
                if entry.name == self._topic:
                    self._types.setdefault(entry.node, set()).add(entry.type_name)
        return self._types.get(node, ())

    def _update_subscription(self) -> None:
        """Adapt type and QoS to the publishers: a new one may have latched messages for us, or be strict."""
        self._types = None
        snapshot = self._observer.around(self._topic)
        profile = profile_of(snapshot, self._topic, depth=DEPTH)
        if profile != self._profile and snapshot.count(EntryKind.PUBLISHER, self._topic):
            self._observer.node.destroy_subscription(self._subscription)
            self._subscribe(profile)

    def _receive(self, data: bytes, info: MessageInfo) -> None:
        subscription = self._subscription
        lost = subscription.dropped + subscription.lost
        missed, self._lost = lost - self._lost, lost
        received = Received(data, info)
        if self._latched is not None:
            self._latched.add(received)
        for reader in self._readers:
            reader.skipped += missed
            reader.add(received)


class TopicFeeds:
    """The topics that the server reads.

    Args:
        observer: Has the node and the graph.
    """

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._feeds: dict[str, TopicFeed] = {}

    def read(self, topic: str, kept: int, wake: Callable[[], None], kind: str = "") -> TopicReader:
        """Begin to read a topic.

        Args:
            topic: Its full name; it need not exist yet.
            kept: How many messages wait for the reader at most; the oldest makes room.
            wake: Called when there are messages to pop.
            kind: The type whose messages are read, where a topic has several; those of nodes that publish
                both are read, too. Empty for all.

        Raises:
            InvalidTopicNameError: The name breaks the rules.
            TooManyTopicsError: `MAX_TOPICS` are read already.
        """
        feed = self._feed(topic)
        reader = TopicReader(feed, kept, wake, kind)
        feed.add(reader)
        return reader

    def listen(
        self,
        topic: str,
        receive: Callable[[Received, bytes], object],
        refused: Callable[[], None],
        kind: str = "",
    ) -> TopicListener:
        """Begin to hand a topic's messages to a function, latched ones that are known at once.

        Args:
            topic: Its full name; it need not exist yet.
            receive: See `TopicListener`; called for the first time before this returns.
            refused: Called when the broker has refused the subscription.
            kind: As for `read`.

        Raises:
            InvalidTopicNameError, TooManyTopicsError: As for `read`.
        """
        feed = self._feed(topic)
        listener = TopicListener(feed, receive, refused, kind)
        feed.add(listener)
        return listener

    def _feed(self, topic: str) -> TopicFeed:
        feed = self._feeds.get(topic)
        if feed is None:
            if len(self._feeds) >= MAX_TOPICS:
                raise TooManyTopicsError(f"{MAX_TOPICS} topics are being read already; close one")
            feed = TopicFeed(self._observer, topic, partial(self._feeds.__delitem__, topic))
            self._feeds[topic] = feed
        return feed
