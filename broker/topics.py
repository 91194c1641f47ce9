"""Topics: who hears whom, decided when something is declared and never per message.

A publisher has one *route* to each link that has matched subscriptions: a run goes there once, byte for byte.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker import credit
from broker.attachments import Attachments
from broker.credit_limits import CreditLimits
from broker.deliveries import Close, Discard, Enqueue, Send
from broker.departed_queues import DepartedQueues, PeerQueue
from broker.latched import latch, unlatch
from broker.notices import Notices, type_difference
from broker.records import PublisherRecord, Route, SubscriptionRecord, Tally, TopicRecord
from proto.batches import message_bytes, slice_batch
from proto.codes import DetachReason, NoticeKind, PolicyKind
from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_U64
from proto.publisher_queue import PublisherQueue
from proto.qos import BEST_EFFORT_DEPTH, KEEP_ALL, Qos, incompatible_policy

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from broker.deliveries import Delivery
    from broker.records import Peer
    from proto import frames
    from proto.frames import Batch


class Topics:
    """All topics of one graph.

    Args:
        emit: Takes each delivery.
        max_queue_bytes: What may wait for a KEEP_ALL subscription.

    Attributes:
        routed: Messages that reached at least one link.
        copies: Messages times links they were routed to: `tallies` says what has become of them.
        unmatched: Messages that nobody was there to hear.
        stale: Messages discarded because their numbers had been seen.
        latched_dropped: Messages that late joiners will miss: too many bytes are latched.
    """

    def __init__(self, emit: Callable[[Delivery], None], *, max_queue_bytes: int) -> None:
        self._emit = emit
        self._max_queue_bytes = max_queue_bytes
        self._topics: dict[str, TopicRecord] = {}
        self._publishers: dict[int, PublisherRecord] = {}
        self._peers_changed: dict[PublisherRecord | SubscriptionRecord, None] = {}
        self._held = False
        """Whether the broker stops: every publisher is held."""
        self._departed = DepartedQueues()
        self._notices = Notices(emit)
        self._attachments = Attachments(emit)
        self.routed = self.copies = self.unmatched = self.stale = self.latched_dropped = 0

    # Declarations

    def join_publisher(self, publisher: PublisherRecord) -> None:
        """Match a publisher that is new or back."""
        self._departed.settle_some()
        self._publishers[publisher.key] = publisher
        topic = publisher.topic = self._topic(publisher.name)
        topic.publishers[publisher.key] = publisher
        for subscription in publisher.awaited_by.values():  # each of them is about to be attached anew
            del subscription.awaits[publisher.key]
        publisher.awaited_by.clear()
        self._notices.begin(publisher)
        for subscription in topic.subscriptions.values():
            self._match(publisher, subscription)
        self._notices.end()
        if self._held:
            self._hold(publisher)

    def join_subscription(self, subscription: SubscriptionRecord) -> None:
        """Match a subscription that is new or back."""
        self._departed.settle_some()
        topic = self._topic(subscription.name)
        topic.subscriptions[subscription.key] = subscription
        self._notices.begin(subscription)
        for publisher in topic.publishers.values():
            self._match(publisher, subscription)
        self._notices.end()

    def forget_publisher(self, publisher: PublisherRecord) -> None:
        """Take no more runs of a publisher that has left for good."""
        self._publishers.pop(publisher.key, None)
        unlatch(publisher)
        for subscription in publisher.awaited_by.values():
            del subscription.awaits[publisher.key]
            self._tell_gone(publisher, subscription)
        publisher.awaited_by.clear()

    def _tell_gone(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        """Tell a subscription that knows that a publisher is suspended not to wait for it."""
        peer = subscription.peer.id
        # Behind what it has said, and behind the word that it is suspended.
        queue = self._departed.last(peer, publisher.gid, publisher.name)
        self._attachments.detach(publisher.key, peer, (subscription.id,), DetachReason.GONE, queue)

    def leave_publisher(self, publisher: PublisherRecord) -> None:
        """Take a publisher out; its readers get what is queued, and then DETACHED."""
        self._leave(publisher.name, publisher)
        reason = DetachReason.SUSPENDED if publisher.peer.suspended else DetachReason.GONE
        for route in publisher.routes.values():
            self._attachments.detach(publisher.key, route.peer.id, route.subscriptions, reason, route.queue)
            peer_queue = PeerQueue(route.queue, route.topic, route.peer.id, route.lives)
            self._departed.leave(publisher.gid, publisher.key, peer_queue)
        publisher.routes.clear()
        for subscription in publisher.matched.values():
            subscription.matched.pop(publisher.key, None)
            self._count(subscription, subscription.peers - 1)
            if publisher.peer.suspended:
                publisher.awaited_by[subscription.key] = subscription
                subscription.awaits[publisher.key] = publisher
        publisher.matched.clear()
        publisher.credits = CreditLimits()
        if publisher.peer.suspended:
            if self._held:
                credit.hold(publisher)
            self._credit(publisher)  # it may come back to readers that set no limit
        self._count(publisher, 0)

    def leave_subscription(self, subscription: SubscriptionRecord) -> None:
        """Take a subscription out; what waits for nobody else on its link is discarded."""
        self._leave(subscription.name, subscription)
        for publisher in subscription.matched.values():
            publisher.matched.pop(subscription.key, None)
            self._count(publisher, publisher.peers - 1)
            self._unroute(publisher, subscription)
            if publisher.credits.remove(subscription.key):
                self._credit(publisher)
        subscription.matched.clear()
        for publisher in subscription.awaits.values():
            del publisher.awaited_by[subscription.key]
            if subscription.peer.suspended:  # it lives on, and nobody will remember what it waits for
                self._tell_gone(publisher, subscription)
        subscription.awaits.clear()
        self._count(subscription, 0)

    def _unroute(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        peer = subscription.peer
        route = publisher.routes[peer.id]
        if peer.suspended:
            # It lives on, and when it is back the publisher may have gone without a word. What its earlier
            # lives have left in the lane goes unread.
            for life in dict.fromkeys((*route.lives, publisher.key)):
                self._attachments.detach(life, peer.id, (subscription.id,), DetachReason.GONE)
        route.remove(subscription)
        if route.subscriptions:
            return
        del publisher.routes[peer.id]
        self._departed.retire(peer.id, route.queue, route.topic)
        self._emit(Discard(peer.id, route.queue))

    def _topic(self, name: str) -> TopicRecord:
        topic = self._topics.get(name)
        if topic is None:
            topic = self._topics[name] = TopicRecord(name)
        return topic

    def _leave(self, name: str, endpoint: PublisherRecord | SubscriptionRecord) -> None:
        topic = self._topics.get(name)
        if topic is None:
            return
        topic.publishers.pop(endpoint.key, None)
        topic.subscriptions.pop(endpoint.key, None)
        if not topic.publishers and not topic.subscriptions:
            del self._topics[name]

    def _match(
        self,
        publisher: PublisherRecord,
        subscription: SubscriptionRecord,
    ) -> None:
        if not _same_type(publisher, subscription):
            self._incompatible_type(publisher, subscription)
            return
        policy = incompatible_policy(publisher.wants, subscription.wants)
        if policy is not None:
            self._incompatible_qos(publisher, subscription, policy)
        publisher.matched[subscription.key] = subscription
        subscription.matched[publisher.key] = publisher
        self._count(publisher, publisher.peers + 1)
        self._count(subscription, subscription.peers + 1)
        self._attach(publisher, subscription)

    def _attach(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        peer = subscription.peer
        route = publisher.routes.get(peer.id)
        if route is None:
            route = publisher.routes[peer.id] = self._route(peer, publisher, subscription.depth)
        route.add(subscription)
        self._attachments.attach(publisher, route, subscription)
        if subscription.depth is None:
            credit.allow(publisher, subscription)
            self._credit(publisher)

    def _route(self, peer: Peer, publisher: PublisherRecord, depth: int | None) -> Route:
        """Return a way for a publisher's runs to a peer.

        A publisher that is back goes on in the lane of its earlier life if that has not been emptied yet:
        its messages must not overtake those it sent before.
        """
        topic = self._topic(publisher.name)
        left = self._departed.take_back(peer.id, publisher.gid, publisher.name)
        if left is None:
            return Route(peer, PublisherQueue(publisher.key, depth), topic)
        left.queue.publisher = 0
        return Route(peer, left.queue, topic, lives=left.lives)

    def forget_peer(self, peer: int) -> None:
        """Nothing can be sent to a peer any more."""
        self._attachments.flush()
        for queue in self._departed.forget(peer):
            self._emit(Discard(peer, queue))

    def _incompatible_type(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        text = (
            f"'{publisher.name}' is not connected between the publisher {publisher.node_name}"
            f" ({publisher.type_name}) and the subscription {subscription.node_name}"
            f" ({subscription.type_name}): {type_difference(publisher.type_name, subscription.type_name)}"
        )
        for endpoint in (publisher, subscription):
            self._notices.tell(endpoint, NoticeKind.INCOMPATIBLE_TYPE, text)

    def _incompatible_qos(
        self, publisher: PublisherRecord, subscription: SubscriptionRecord, policy: PolicyKind
    ) -> None:
        last = f"Messages are delivered all the same. Last incompatible policy: {policy.name}"
        for endpoint, text in (
            (
                publisher,
                f"New subscription discovered on topic '{publisher.name}', requesting incompatible QoS.",
            ),
            (
                subscription,
                f"New publisher discovered on topic '{publisher.name}', offering incompatible QoS.",
            ),
        ):
            self._notices.tell(endpoint, NoticeKind.INCOMPATIBLE_QOS, f"{text} {last}", policy)

    def _count(self, endpoint: PublisherRecord | SubscriptionRecord, peers: int) -> None:
        if endpoint.peers != peers:
            endpoint.set_peers(peers)
            self._peers_changed[endpoint] = None

    def flush(self) -> None:
        """Tell who hears whom now, and every endpoint whose number of counterparts has changed."""
        if self._attachments.pending:
            self._attachments.flush()
        if not self._peers_changed:
            return
        changed, self._peers_changed = self._peers_changed, {}
        for endpoint in changed:
            self._emit(Send(endpoint.peer.id, endpoint.matched_frame()))

    # Messages

    def run(self, peer: Peer, batch: Batch) -> None:
        """Route a run.

        Raises:
            ProtocolError: The publisher is not this link's, or goes beyond its credit or all numbers.
        """
        publisher = self._owned(peer, batch.publisher)
        after = batch.first_sequence + batch.length
        if after > MAX_U64:
            raise ProtocolError(ErrorCode.MALFORMED, "BATCH: the number after its last one is above 2^64 - 1")
        credit.check(publisher, batch)
        seen = publisher.next_sequence - batch.first_sequence
        size = message_bytes(batch)
        publisher.bytes += size
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
        if publisher.keep:
            missed = latch(publisher, batch)
            topic.latched_dropped += missed
            self.latched_dropped += missed
        routes = publisher.routes
        if not routes:
            self.unmatched += batch.length
            return
        self.routed += batch.length
        self.copies += batch.length * len(routes)
        for route in routes.values():
            self._emit(Enqueue(route.peer.id, route.queue, batch))
            if route.queue.depth is None and route.queue.pending_bytes > self._max_queue_bytes:
                self._overflow(publisher, route)

    def _overflow(self, publisher: PublisherRecord, route: Route) -> None:
        """Credit should have prevented this: whoever ignores it must go."""
        if publisher.echoes_owed:
            text = f"the publisher on '{publisher.name}' does not confirm its credit"
            self._emit(Close(publisher.peer.id, ErrorCode.CREDIT, text))
        else:
            text = f"a subscription to '{publisher.name}' grants credit without reading"
            self._emit(Close(route.peer.id, ErrorCode.LIMIT, text))

    def _owned(self, peer: Peer, number: int) -> PublisherRecord:
        publisher = self._publishers.get(number)
        if publisher is None or publisher.peer is not peer:
            text = f"this link has no publisher with the id {number}"
            raise ProtocolError(ErrorCode.UNKNOWN_ID, text)
        return publisher

    def asserted(self, peer: Peer, frame: frames.Assert) -> None:
        """A publisher says that it is alive: its readers hear it.

        Raises:
            ProtocolError: The publisher is not this link's.
        """
        publisher = self._owned(peer, frame.publisher)
        for route in publisher.routes.values():
            self._emit(Send(route.peer.id, frame))

    def grant(self, subscription: SubscriptionRecord, frame: frames.Grant) -> None:
        """GRANT came. One for a publisher that has gone has crossed its DETACHED."""
        publisher = subscription.matched.get(frame.publisher)
        if publisher is not None:
            publisher.credits.grant(subscription.key, frame.sequence_limit, frame.byte_limit)
            self._credit(publisher)

    def credit_confirmed(self, peer: Peer, frame: frames.Credit) -> None:
        """CREDIT came back."""
        credit.confirmed(self._owned(peer, frame.publisher))

    def hold(self) -> None:
        """Let no publisher send more than what is on its way, nor any that comes."""
        self._held = True
        for publisher in self._publishers.values():
            self._hold(publisher)

    def _hold(self, publisher: PublisherRecord) -> None:
        credit.hold(publisher)
        self._credit(publisher)

    def _credit(self, publisher: PublisherRecord) -> None:
        for delivery in credit.update(publisher):
            self._emit(delivery)

    def tallies(self) -> tuple[Tally, dict[TopicRecord, Tally]]:
        """Return what has become of all copies, always `copies` together; and the same by topic."""
        return self._departed.tallies(self._queues_in_use())

    def peer_queues(self) -> list[PeerQueue]:
        """Return all lanes, those of publishers and readers that have gone included."""
        return [*self._queues_in_use(), *self._departed.all()]

    def _queues_in_use(self) -> Iterator[PeerQueue]:
        for publisher in self._publishers.values():
            for route in publisher.routes.values():
                yield PeerQueue(route.queue, route.topic, route.peer.id)

    def records(self) -> Collection[TopicRecord]:
        """Return all topics that somebody has declared something on, and is not suspended."""
        return self._topics.values()

    def publishers(self) -> Collection[PublisherRecord]:
        """Return all publishers, those that are suspended included."""
        return self._publishers.values()


def subscription_depth(qos: Qos) -> int | None:
    """Return the depth that counts in a lane; None for a subscription that needs credit."""
    if qos.needs_credit:
        return None
    return BEST_EFFORT_DEPTH if qos.history == KEEP_ALL else qos.depth


def _same_type(publisher: PublisherRecord, subscription: SubscriptionRecord) -> bool:
    """Tell whether a subscription takes a publisher's type: a raw one, without a type, takes every one."""
    return not subscription.type_name or (
        subscription.type_name == publisher.type_name and subscription.type_hash == publisher.type_hash
    )
