"""Collects ATTACHED and DETACHED frames, so that many attachments that change at once need few frames.

A link that is suspended or restored may have tens of thousands of subscriptions. Both frames name any number
of subscriptions to one publisher, so attachments are collected by publisher and link until `flush`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from broker.access.rules import Action
from broker.routing.deliveries import Enqueue, EnqueueLatched, Send
from broker.routing.latched import LatchedReplay
from broker.routing.mirrored import wants_latched
from proto.wire import frames
from proto.wire.codec import encode

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from broker.routing.deliveries import Delivery
    from broker.routing.records import PublisherRecord, Route, SubscriptionRecord
    from proto.queues.publisher_queue import PublisherQueue
    from proto.wire.codes import DetachReason

T = TypeVar("T")

READERS_PER_FRAME: Final = 4000
"""The most subscriptions in one ATTACHED or DETACHED frame."""


class AttachmentFrames:
    """The ATTACHED and DETACHED frames that one graph has to send.

    Args:
        emit: Takes each delivery.

    Attributes:
        pending: Whether anything is to be sent. Call `flush` before the next batch is routed, and before a
            queue is discarded that a DETACHED must go through.
    """

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit
        self._attached: dict[
            tuple[int, int, int], tuple[PublisherRecord, Route, list[SubscriptionRecord]]
        ] = {}
        """By publisher, peer, and first live sequence number."""
        self._detached: dict[tuple[int, int, PublisherQueue | None, DetachReason], list[int]] = {}
        """By publisher, peer, the queue that carries the frame, and the reason."""
        self.pending = False

    def attach(self, publisher: PublisherRecord, route: Route, subscription: SubscriptionRecord) -> None:
        """Note that a subscription is attached to a publisher."""
        if self._detached:
            self.flush()
        self.pending = True
        key = publisher.key, route.peer.id, publisher.first_for(subscription)
        self._attached.setdefault(key, (publisher, route, []))[2].append(subscription)

    def detach(
        self,
        publisher: int,
        peer: int,
        readers: Collection[int],
        reason: DetachReason,
        queue: PublisherQueue | None = None,
    ) -> None:
        """Note that subscriptions of a peer are detached from a publisher.

        Args:
            publisher: Its id, or one of its earlier ids.
            peer: The subscriptions' peer.
            readers: The subscriptions' ids.
            reason: Why.
            queue: Send the frame after the content of this queue; None: before everything else.
        """
        self.flush_attached()
        self.pending = True
        self._detached.setdefault((publisher, peer, queue, reason), []).extend(readers)

    def flush_attached(self) -> None:
        """Send the frames if they are ATTACHED; otherwise they are DETACHED, or there are none."""
        if self._attached:
            self.flush()

    def flush(self) -> None:
        """Send the frames."""
        detached, self._detached = self._detached, {}
        for (number, peer, queue, reason), readers in detached.items():
            for part in _slices(readers):
                frame = frames.Detached(number, tuple(part), reason)
                self._emit(Send(peer, frame) if queue is None else Enqueue(peer, queue, encode(frame)))
        attached, self._attached = self._attached, {}
        for (*_, first), (publisher, route, subscriptions) in attached.items():
            for some in _slices(subscriptions):
                self._send_attached(publisher, route, some, first)
        self.pending = False

    def _send_attached(
        self, publisher: PublisherRecord, route: Route, subscriptions: list[SubscriptionRecord], first: int
    ) -> None:
        frame = frames.Attached(
            publisher.key,
            tuple(subscription.id for subscription in subscriptions),
            publisher.gid,
            first,
            publisher.node_name if route.peer.may(Action.SEE, publisher.node_name) else "",
            publisher.qos,
        )
        self._emit(Enqueue(route.peer.id, route.queue, encode(frame)))
        for subscription in subscriptions:
            if wants_latched(route, subscription):
                source = LatchedReplay(publisher, route, subscription)
                self._emit(EnqueueLatched(route.peer.id, route.queue, source))


def _slices(entries: list[T]) -> Iterator[list[T]]:
    for start in range(0, len(entries), READERS_PER_FRAME):
        yield entries[start : start + READERS_PER_FRAME]
