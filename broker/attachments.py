"""Who hears whom, as links are told of it: many pairs that come or go at once cost few frames.

A link that is suspended or back may have tens of thousands of subscriptions. Both ATTACHED and DETACHED name
any number of them for one publisher; so the pairs are put together, by publisher and link, until `flush`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from broker.deliveries import Enqueue, Send
from broker.latched import replays
from proto import frames
from proto.codec import encode

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from broker.deliveries import Delivery
    from broker.records import PublisherRecord, Route, SubscriptionRecord
    from proto.codes import DetachReason
    from proto.publisher_queue import PublisherQueue

T = TypeVar("T")

READERS_PER_FRAME: Final = 4000
"""Subscriptions named in one ATTACHED or DETACHED frame."""


class Attachments:
    """The ATTACHED and DETACHED frames of one graph.

    Args:
        emit: Takes each delivery.

    Attributes:
        pending: Whether there is something to tell: `flush` does, before a run is routed to those that came,
            and before a lane is discarded that something is to be told in.
    """

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit
        self._attached: dict[
            tuple[int, int, int], tuple[PublisherRecord, Route, list[SubscriptionRecord]]
        ] = {}
        """By publisher, peer, and the number from which on runs are for them."""
        self._detached: dict[tuple[int, int, PublisherQueue | None, DetachReason], list[int]] = {}
        """By publisher, peer, the lane to say it in, and why."""
        self.pending = False

    def attach(self, publisher: PublisherRecord, route: Route, subscription: SubscriptionRecord) -> None:
        """A publisher's runs are for this subscription, too."""
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
        """A publisher's runs are for these subscriptions of a peer no longer.

        Args:
            publisher: Its id, or that of one of its earlier lives.
            peer: Whose subscriptions they are.
            readers: Their ids.
            reason: Why.
            queue: Say it behind what waits there; None: before everything else.
        """
        if self._attached:
            self.flush()
        self.pending = True
        self._detached.setdefault((publisher, peer, queue, reason), []).extend(readers)

    def flush(self) -> None:
        """Tell the links."""
        detached, self._detached = self._detached, {}
        for (number, peer, queue, reason), readers in detached.items():
            for part in _slices(readers):
                frame = frames.Detached(number, tuple(part), reason)
                self._emit(Send(peer, frame) if queue is None else Enqueue(peer, queue, encode(frame)))
        attached, self._attached = self._attached, {}
        for (*_, first), (publisher, route, subscriptions) in attached.items():
            for some in _slices(subscriptions):
                self._tell_attached(publisher, route, some, first)
        self.pending = False

    def _tell_attached(
        self, publisher: PublisherRecord, route: Route, subscriptions: list[SubscriptionRecord], first: int
    ) -> None:
        frame = frames.Attached(
            publisher.key,
            tuple(subscription.id for subscription in subscriptions),
            publisher.gid,
            first,
            publisher.node_name,
            publisher.qos,
        )
        self._emit(Enqueue(route.peer.id, route.queue, encode(frame)))
        for subscription in subscriptions:
            if subscription.wants.latched:
                for replay in replays(publisher, subscription):
                    self._emit(Enqueue(route.peer.id, route.queue, replay))


def _slices(entries: list[T]) -> Iterator[list[T]]:
    for start in range(0, len(entries), READERS_PER_FRAME):
        yield entries[start : start + READERS_PER_FRAME]
