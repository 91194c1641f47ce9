"""Routes: the links that get a publisher's batches. Decided at attachment, never per message.

A publisher has one route to each link with matched subscriptions: a batch goes there once, byte for byte.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.access.rules import Action
from broker.routing import mirrored
from broker.routing.attachment_frames import AttachmentFrames
from broker.routing.deliveries import Close, Discard, Enqueue, Shed
from broker.routing.departed_queues import DepartedQueues, PeerQueue
from broker.routing.latched import LatchedExpiry, latch, unlatch
from broker.routing.reader_credit import ReaderCredit
from broker.routing.records import PublisherRecord, Route, SubscriptionRecord, Tally, TopicRecord
from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_U64
from proto.queues.batches import message_bytes, slice_batch
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codes import DetachReason

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from broker.access.rules import Principal
    from broker.routing.deliveries import Delivery
    from broker.routing.records import Peer
    from broker.routing.router_limits import RouterLimits
    from proto.wire.frames import Batch


class Routes:
    """The publishers of one graph, and their routes.

    Args:
        emit: Takes each delivery.
        max_keep_all_queue_bytes: Bytes that may wait in one publisher queue for a KEEP_ALL subscription.

    Attributes:
        reader_credit: The limits of the routes from KEEP_LAST publishers to KEEP_ALL subscriptions.
        publishers: All publishers by id, suspended ones included.
        departed: Queues that get no batches any more.
        latched_expiry: The publishers whose latched messages expire.
        routed: Messages that reached at least one link.
        copies: Messages, counted once per link to which they were routed; `tallies` has their outcomes.
        unmatched: Messages without a subscription.
        stale: Messages discarded because their sequence numbers had been received before.
        latched_dropped: Latched messages dropped because too many bytes were latched.
        report_mesh: Called with another broker of the mesh that has not kept to flow control, and why.
    """

    def __init__(self, emit: Callable[[Delivery], None], limits: RouterLimits) -> None:
        self._emit = emit
        self._max_keep_all_queue_bytes = limits.max_keep_all_queue_bytes
        self.publishers: dict[int, PublisherRecord] = {}
        self.departed = DepartedQueues(limits.max_departed_queues)
        self.latched_expiry = LatchedExpiry()
        self._attachments = AttachmentFrames(emit)
        self.reader_credit = ReaderCredit(emit)
        self.report_mesh: Callable[[int, str], None] = _ignore
        self.routed = self.copies = self.unmatched = self.stale = self.latched_dropped = 0

    # Publishers

    def add_publisher(self, publisher: PublisherRecord) -> None:
        """Accept batches of a publisher that is new or back."""
        self.publishers[publisher.key] = publisher

    def remove_publisher(self, publisher: PublisherRecord) -> None:
        """Remove a publisher that will not come back, and its latched messages."""
        self.publishers.pop(publisher.key, None)
        self.latched_expiry.remove(publisher)
        unlatch(publisher)

    def publisher(self, peer: Peer, number: int) -> PublisherRecord:
        """Return a publisher of this peer.

        Raises:
            ProtocolError: The peer has none with this id.
        """
        publisher = self.publishers.get(number)
        if publisher is None or publisher.peer.id != peer.id:
            text = f"this link has no publisher with the id {number}"
            raise ProtocolError(ErrorCode.UNKNOWN_ID, text)
        return publisher

    # Routes

    def attach(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        """Route a publisher's batches to a subscription, too."""
        peer = subscription.peer
        route = publisher.routes.get(peer.id)
        if route is None:
            route = publisher.routes[peer.id] = self._new_route(peer, publisher)
        route.add(subscription)
        self._attachments.attach(publisher, route, subscription)

    def _new_route(self, peer: Peer, publisher: PublisherRecord) -> Route:
        """Return a route to a peer.

        A publisher that has come back resumes the queue it left if that is not empty yet, so that its new
        messages do not overtake the earlier ones.
        """
        own_depth = None if publisher.waits_for_readers else publisher.wants.depth
        least_depth = mirrored.least_depth(peer, publisher)
        left = self.departed.resume(peer.id, publisher.gid, publisher.name)
        if left is None:
            queue = PublisherQueue(publisher.key, 1)
            queue.restart(publisher.key, publisher.next_sequence)
            return Route(peer, queue, publisher.topic, own_depth, least_depth=least_depth)
        left.queue.publisher = 0
        earlier_ids = left.earlier_ids
        return Route(
            peer, left.queue, publisher.topic, own_depth, earlier_ids=earlier_ids, least_depth=least_depth
        )

    def detach(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        """Stop routing to a subscription that leaves; discard the queue if nobody else needs it."""
        peer = subscription.peer
        route = publisher.routes[peer.id]
        self._attachments.flush_attached()  # into the queue, which may be discarded below
        if peer.suspended:
            # It is not informed again if the publisher goes before it is back. Messages of the publisher's
            # earlier ids in the queue are not read either.
            for number in dict.fromkeys((*route.earlier_ids, publisher.key)):
                self._attachments.detach(number, peer.id, (subscription.id,), DetachReason.GONE)
        route.remove(subscription)
        if route.subscriptions:
            self.reader_credit.remove(route, subscription)
            return
        del publisher.routes[peer.id]
        self.departed.add_unwanted(PeerQueue(route.queue, route.topic, peer.id, publisher.peer))
        self._emit(Discard(peer.id, route.queue))

    def pause(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        """Stop routing to a stalled subscription, which stays attached; it still gets what is queued."""
        route = publisher.routes[subscription.peer.id]
        route.remove(subscription)
        if not route.subscriptions:
            del publisher.routes[route.peer.id]
            peer_queue = _peer_queue(publisher, route)
            if excess := self.departed.add(publisher.gid, publisher.key, peer_queue):
                self._emit(Shed(route.peer.id, excess))

    def detach_all(self, publisher: PublisherRecord) -> None:
        """End the routes of a publisher that leaves; its readers get what is queued, and then DETACHED."""
        reason = leaving_reason(publisher)
        pending = self._attachments.pending  # an ATTACHED that is not in the queue yet
        for route in publisher.routes.values():
            route.queue.sequence_limit = route.queue.byte_limit = None  # nobody grants credit any more
            peer_queue = _peer_queue(publisher, route)
            empty = route.queue.empty and not pending
            queue = None if empty else route.queue
            self._attachments.detach(publisher.key, route.peer.id, route.subscriptions, reason, queue)
            if empty:
                self.departed.forget(peer_queue)
            elif excess := self.departed.add(publisher.gid, publisher.key, peer_queue):
                self._attachments.flush()
                self._emit(Shed(route.peer.id, excess))
        publisher.routes.clear()

    def report_left(
        self,
        publisher: PublisherRecord,
        subscription: SubscriptionRecord,
        reason: DetachReason = DetachReason.GONE,
    ) -> None:
        """Report to a subscription without a route that a publisher has left.

        Args:
            publisher: The publisher.
            subscription: It is stalled, or the publisher is known to it as suspended.
            reason: SUSPENDED if the publisher may come back.
        """
        peer = subscription.peer.id
        # After the publisher's messages and an earlier DETACHED with the reason SUSPENDED.
        queue = self.departed.latest(peer, publisher.gid, publisher.name)
        self._attachments.detach(publisher.key, peer, (subscription.id,), reason, queue)

    def remove_peer(self, peer: int) -> None:
        """Discard what waits for a peer that is gone."""
        self._attachments.flush()
        for queue in self.departed.remove_peer(peer):
            self._emit(Discard(peer, queue))

    def drop_denied(self, peers: Mapping[int, Peer], renew: Callable[[Principal], Principal | None]) -> None:
        """Drop messages in departed queues that their publisher may not publish or their reader not get.

        Args:
            peers: Those with a connection, by id.
            renew: See `Router.drop_denied`.
        """
        self.flush()
        for each in self.departed.all():
            source, reader, name = each.source, peers.get(each.peer), each.topic.name
            if source.principal is not None and source.id not in peers:
                principal = renew(source.principal)
                allowed = principal is not None and principal.rights.may(Action.PUBLISH, name)
            else:
                allowed = source.may(Action.PUBLISH, name)
            if reader is not None and not (allowed and reader.may(Action.SUBSCRIBE, name)):
                self._emit(Shed(reader.id, each.queue))

    def prune(self, *, at_least: int | None = None) -> None:
        """Forget empty queues if there are many, or so many. Only between the handling of two frames."""
        self.departed.prune(at_least=at_least)

    def flush(self) -> None:
        """Send ATTACHED and DETACHED frames."""
        if self._attachments.pending:
            self._attachments.flush()

    # Messages

    def route(self, peer: Peer, batch: Batch) -> None:
        """Route a batch.

        Raises:
            ProtocolError: The publisher is not this peer's, exceeds its credit or the greatest number, or is
                latched and sends a reference.
        """
        publisher = self.publisher(peer, batch.publisher)
        if self._attachments.pending:  # ATTACHED comes before the first batch
            self._attachments.flush()
        after = batch.first_sequence + batch.length
        if after > MAX_U64:
            raise ProtocolError(ErrorCode.MALFORMED, "BATCH: the number after its last one is above 2^64 - 1")
        credit = publisher.credit
        if credit.limit is not None and not mirrored.is_checked_elsewhere(peer):
            credit.check(publisher.name, publisher.next_sequence, batch)
        # Counted whole, repetitions included, as the publisher counts what it sends: both must agree on the
        # bytes that its credit is for.
        seen = publisher.next_sequence - batch.first_sequence
        size = message_bytes(batch)
        credit.bytes += size
        if seen > 0:
            self.stale += min(seen, batch.length)
            if seen >= batch.length:
                return
            batch = slice_batch(batch, seen, batch.length)
            size = message_bytes(batch)
        publisher.next_sequence = after
        topic = publisher.topic
        topic.messages += batch.length
        topic.bytes += size
        topic.by_reference += not batch.raw
        if publisher.keep:
            missed = latch(publisher, batch)
            topic.latched_dropped += missed
            self.latched_dropped += missed
            self.latched_expiry.add(publisher)
        routes = publisher.routes
        if not routes:
            self.unmatched += batch.length
            return
        self.routed += batch.length
        self.copies += batch.length * len(routes)
        # One object for all links: their queues share the batch, and the bytes of its frame.
        for route in routes.values():
            queue = route.queue
            self._emit(Enqueue(route.peer.id, queue, batch))
            # The batch is not in the queue yet: the limit leaves space for one more message.
            if queue.depth is None and queue.pending_bytes > self._max_keep_all_queue_bytes:
                self._overflow(publisher, route)

    def _overflow(self, publisher: PublisherRecord, route: Route) -> None:
        """Close the link that ignores flow control, which should have prevented this."""
        if publisher.mirrored and publisher.credit.exceeded(publisher.next_sequence):
            text = f"the publisher on '{publisher.name}' sends without credit"
            self.report_mesh(publisher.broker, text)
        elif publisher.credit.unconfirmed and not publisher.mirrored:
            text = f"the publisher on '{publisher.name}' does not confirm its credit"
            self._emit(Close(publisher.peer.id, ErrorCode.CREDIT, text))
        else:
            text = f"a subscription to '{publisher.name}' grants credit without reading"
            for broker in mirrored.brokers_of(route):
                self.report_mesh(broker, text)
            if not mirrored.is_checked_elsewhere(route.peer):
                self._emit(Close(route.peer.id, ErrorCode.LIMIT, text))

    # Statistics

    def tallies(self) -> tuple[Tally, dict[TopicRecord, Tally]]:
        """Return the outcomes of all copies, whose sum is always `copies`, in total and by topic."""
        return self.departed.tallies(self._queues_in_use())

    def peer_queues(self) -> list[PeerQueue]:
        """Return all publisher queues, departed ones included."""
        return [*self._queues_in_use(), *self.departed.all()]

    def _queues_in_use(self) -> Iterator[PeerQueue]:
        for publisher in self.publishers.values():
            for route in publisher.routes.values():
                yield PeerQueue(route.queue, route.topic, route.peer.id, publisher.peer)


def _ignore(*_: object) -> None:
    """Take a report, and do nothing."""


def leaving_reason(publisher: PublisherRecord) -> DetachReason:
    """Return why the readers of a publisher that leaves are detached: SUSPENDED if it may come back."""
    return DetachReason.SUSPENDED if publisher.peer.suspended else DetachReason.GONE


def _peer_queue(publisher: PublisherRecord, route: Route) -> PeerQueue:
    return PeerQueue(route.queue, route.topic, route.peer.id, publisher.peer, route.earlier_ids)
