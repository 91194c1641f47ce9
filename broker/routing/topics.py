"""Topics: which publishers and subscriptions match, decided when an endpoint is declared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.access.rules import Action
from broker.routing import mirrored
from broker.routing.deliveries import Send
from broker.routing.flow_control import HOLD, CreditLimits
from broker.routing.latched import unlatch
from broker.routing.matching import exceeds, may_match
from broker.routing.records import PublisherRecord, SubscriptionRecord, TopicRecord
from broker.routing.routes import leaving_reason
from proto.wire import frames
from proto.wire.codes import NoticeKind, PolicyKind
from proto.wire.qos import BEST_EFFORT_DEPTH, KEEP_ALL, Qos, incompatible_policy

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.mirrored import Open
    from broker.routing.notices import Notices
    from broker.routing.records import Peer
    from broker.routing.routes import Routes
    from broker.routing.stalls import Stalls

HIDDEN: Final = "a KEEP_ALL subscription that this user may not see"


class Topics:
    """All topics of one graph.

    Args:
        emit: Takes each delivery.
        notices: Reports about matching.
        routes: The routes of the graph's publishers.
        stalls: Finds KEEP_ALL subscriptions that take nothing.

    Attributes:
        by_name: The topics.
        matched: Publishers with a matched subscription, by id. Regular checks need not look at the others,
            of which another broker may have many.
    """

    def __init__(
        self,
        emit: Callable[[Delivery], None],
        notices: Notices,
        routes: Routes,
        stalls: Stalls,
    ) -> None:
        self._emit = emit
        self._routes = routes
        self.by_name: dict[str, TopicRecord] = {}
        self.matched: dict[int, PublisherRecord] = {}
        self._held = False
        """Whether the broker is stopping, so that every publisher is held."""
        self._notices = notices
        self.stalls = stalls

    def exceeds(self, endpoint: PublisherRecord | SubscriptionRecord, most: int) -> bool:
        """Return whether an endpoint, if it joined, would raise the `matches` of its peer above `most`."""
        topic = self.by_name.get(endpoint.name)
        if topic is None:
            return False
        if isinstance(endpoint, PublisherRecord):
            subscriptions = topic.subscriptions.values()
            return exceeds(endpoint.peer, subscriptions, lambda other: _fits(endpoint, other), most)
        publishers = topic.publishers.values()
        return exceeds(endpoint.peer, publishers, lambda other: _fits(other, endpoint), most)

    def join_publisher(self, publisher: PublisherRecord) -> None:
        """Match a publisher that is new or restored."""
        # Empty departed queues go first: a publisher that comes back must resume a queue only if something is
        # left in it.
        self._routes.prune()
        self._routes.add_publisher(publisher)
        name = publisher.name
        topic = publisher.topic = self.by_name.get(name) or self.by_name.setdefault(name, TopicRecord(name))
        topic.publishers[publisher.key] = publisher
        # It has come back from a suspension, so that nobody has to learn any more how that ends.
        for subscription in publisher.awaited_by.values():  # each is attached again below
            del subscription.awaits[publisher.key]
        publisher.awaited_by.clear()
        self._notices.begin(publisher)
        for subscription in topic.subscriptions.values():
            self._match(publisher, subscription)
        self._notices.end()
        # While the broker stops, a publisher that reconnects late must not send what nobody can read any
        # more.
        if self._held:
            self._hold(publisher)

    def join_subscription(self, subscription: SubscriptionRecord) -> None:
        """Match a subscription that is new or restored."""
        self._routes.prune()
        topic = self.by_name.setdefault(subscription.name, TopicRecord(subscription.name))
        topic.subscriptions[subscription.key] = subscription
        self._notices.begin(subscription)
        for publisher in topic.publishers.values():
            self._match(publisher, subscription)
        self._notices.end()

    def remove_publisher(self, publisher: PublisherRecord) -> None:
        """Forget a publisher that has left for good."""
        self._routes.remove_publisher(publisher)
        for subscription in publisher.awaited_by.values():
            del subscription.awaits[publisher.key]
            self._routes.report_left(publisher, subscription)
        publisher.awaited_by.clear()

    def open_publisher(self, peer: Peer, frame: Open) -> None:
        """Attach subscriptions to a publisher of another broker: those it has not been open for.

        Raises:
            ProtocolError: The peer does not have the publisher.
        """
        publisher = self._routes.publisher(peer, frame.publisher)
        # Its last reader here left while the Open was under way; the next reader asks the other broker again.
        if not publisher.matched:
            return
        announced = publisher.unattached.intersection(frame.subscriptions)
        publisher.unattached -= announced
        if publisher.opened:
            publisher.next_sequence = max(publisher.next_sequence, frame.next_sequence)
            attached = [publisher.matched[key] for key in sorted(announced)]
        else:
            publisher.opened = True
            publisher.next_sequence = frame.next_sequence
            # Of a publisher that has come back, what it sends again is latched, too.
            publisher.live_sequence = max(publisher.live_sequence, frame.live_sequence)
            attached = [*publisher.matched.values()]
        for subscription in attached:
            self._attach(publisher, subscription)
        self._routes.flush()

    def leave_publisher(self, publisher: PublisherRecord) -> None:
        """Unmatch a publisher that is gone or suspended."""
        self._leave(publisher)
        self._routes.detach_all(publisher)
        for subscription in publisher.matched.values():
            subscription.matched.pop(publisher.key, None)
            # A stalled subscription is not attached, so that `detach_all` has not told it.
            if subscription.stalled and publisher.waits_for_readers:
                self._routes.report_left(publisher, subscription, leaving_reason(publisher))
            self._notices.set_count(subscription, subscription.peers - 1)
            # The subscription has heard SUSPENDED. If the publisher does not come back, it needs GONE as
            # well.
            if publisher.peer.suspended:
                publisher.awaited_by[subscription.key] = subscription
                subscription.awaits[publisher.key] = publisher
        publisher.matched.clear()
        self.matched.pop(publisher.key, None)
        publisher.unattached.clear()
        publisher.credit.limits = CreditLimits()
        if publisher.peer.suspended:  # it may be restored to readers that set no limit
            if self._held:
                self._hold(publisher)
            else:
                self._update_credit(publisher)
        self._notices.set_count(publisher, 0)

    def leave_subscription(self, subscription: SubscriptionRecord) -> None:
        """Unmatch a subscription that is gone or suspended."""
        self._leave(subscription)
        for publisher in subscription.matched.values():
            publisher.matched.pop(subscription.key, None)
            if not publisher.matched:
                self.matched.pop(publisher.key, None)
            self._notices.set_count(publisher, publisher.peers - 1)
            if _is_attached(publisher, subscription):
                self._routes.detach(publisher, subscription)
            publisher.unattached.discard(subscription.key)
            if publisher.credit.limits.remove(subscription.key):
                self._update_credit(publisher)
            if mirrored.close_without_readers(publisher):
                unlatch(publisher)
        subscription.matched.clear()
        subscription.stalled = False
        self.stalls.end(subscription)
        for publisher in subscription.awaits.values():
            del publisher.awaited_by[subscription.key]
            if subscription.peer.suspended:  # this is forgotten below
                self._routes.report_left(publisher, subscription)
        subscription.awaits.clear()
        self._notices.set_count(subscription, 0)

    def _leave(self, endpoint: PublisherRecord | SubscriptionRecord) -> None:
        topic = self.by_name.get(endpoint.name)
        if topic is None:
            return
        topic.publishers.pop(endpoint.key, None)
        topic.subscriptions.pop(endpoint.key, None)
        if not topic.publishers and not topic.subscriptions:
            del self.by_name[endpoint.name]

    def _match(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        if not may_match(publisher, subscription):
            return
        if not _same_type(publisher, subscription):
            self._notices.report_types(publisher, "publisher", subscription, "subscription")
            return
        policy = incompatible_policy(publisher.wants, subscription.wants)
        if policy is not None:
            strict = _is_strict(publisher, subscription)
            self._report_qos(publisher, subscription, policy, strict=strict)
            if strict:
                return
        # Both sides know each other before the count changes: NOTICE and MATCHED follow from these maps.
        publisher.matched[subscription.key] = subscription
        self.matched[publisher.key] = publisher
        subscription.matched[publisher.key] = publisher
        self._notices.set_count(publisher, publisher.peers + 1)
        self._notices.set_count(subscription, subscription.peers + 1)
        mirrored.await_attachment(publisher, subscription)
        self._attach(publisher, subscription)

    def _attach(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        if not _is_attached(publisher, subscription):
            return
        self._routes.attach(publisher, subscription)
        if subscription.depth is not None:
            return
        if not publisher.waits_for_readers:
            if mirrored.limits_keep_last(subscription):
                self._routes.reader_credit.add(publisher, subscription)
        else:
            credit = publisher.credit
            sequence_limit = publisher.first_for(subscription) + subscription.window_messages
            credit.limits.add(subscription.key, sequence_limit, subscription.window_bytes, credit.bytes)
            self._update_credit(publisher)

    def _report_qos(
        self,
        publisher: PublisherRecord,
        subscription: SubscriptionRecord,
        policy: PolicyKind,
        *,
        strict: bool,
    ) -> None:
        for endpoint, event, effect in (
            (publisher, "New subscription discovered on topic '{}', requesting", "sent to"),
            (subscription, "New publisher discovered on topic '{}', offering", "received from"),
        ):
            result = f"No messages will be {effect} it" if strict else "Messages are delivered all the same"
            text = f"{event.format(publisher.name)} incompatible QoS. {result}."
            text += f" Last incompatible policy: {policy.name}"
            self._notices.report(endpoint, NoticeKind.INCOMPATIBLE_QOS, text, policy)

    # Flow control

    def grant(self, peer: Peer, frame: frames.Grant) -> None:
        """Raise the limits that a subscription sets; ignore a GRANT that crossed the publisher's DETACHED."""
        subscription = peer.endpoints.get(frame.subscription)
        if not isinstance(subscription, SubscriptionRecord):
            return
        self.stalls.end(subscription)
        publisher = subscription.matched.get(frame.publisher)
        if publisher is not None:
            elsewhere = mirrored.grant_elsewhere(publisher, subscription, frame)
            if elsewhere is not None:
                self._emit(Send(publisher.peer.id, elsewhere))
        if subscription.stalled:  # its new limits begin with ATTACHED
            self._resume(subscription)
            return
        if publisher is None:
            return
        if not publisher.waits_for_readers:
            self._routes.reader_credit.grant(publisher, subscription, frame)
        else:
            publisher.credit.limits.grant(subscription.key, frame.sequence_limit, frame.byte_limit)
            self._update_credit(publisher)

    def check_stalls(self, now: float) -> list[str]:
        """Suspend the credit of subscriptions that have taken nothing for too long.

        Args:
            now: A monotonic time in seconds.

        Returns:
            What has happened, for the log.
        """
        # Held publishers wait for the broker, not for a reader.
        if self._held:
            return []
        stalled = self.stalls.check(self.matched.values(), now)
        publishers: dict[PublisherRecord, list[SubscriptionRecord]] = {}
        for subscription in stalled:
            subscription.stalled = True
            text = (
                f"'{subscription.name}': this KEEP_ALL subscription {self.stalls.describe(subscription)}."
                " It misses messages until it takes one: iterate it, give it a callback, destroy it, or"
                " create it with a longer stall_timeout_sec"
            )
            self._notices.send(subscription, NoticeKind.STALLED, text)
            for publisher in subscription.matched.values():
                if publisher.waits_for_readers:
                    publishers.setdefault(publisher, []).append(subscription)
        # By publisher: one CREDIT and at most `MAX_NOTICES` NOTICEs each, however many readers stall at once.
        for publisher, subscriptions in publishers.items():
            self._suspend_credit(publisher, subscriptions)
        return [
            f"'{each.name}': the KEEP_ALL subscription of {each.node_name} {self.stalls.describe(each)}"
            for each in stalled
        ]

    def _suspend_credit(self, publisher: PublisherRecord, stalled: list[SubscriptionRecord]) -> None:
        """Let a publisher no longer wait for stalled subscriptions, and tell it."""
        self._notices.begin(publisher)
        for subscription in stalled:
            publisher.credit.limits.remove(subscription.key)
            if subscription.key not in publisher.unattached:
                self._routes.pause(publisher, subscription)
            visible = publisher.peer.may(Action.SEE, subscription.node_name)
            whose = f"the KEEP_ALL subscription of {subscription.node_name}" if visible else HIDDEN
            text = f"'{subscription.name}': {whose} {self.stalls.describe(subscription)}"
            self._notices.report(publisher, NoticeKind.STALLED, text)
        self._notices.end()
        self._update_credit(publisher)

    def _resume(self, subscription: SubscriptionRecord) -> None:
        """Attach a stalled subscription again, from the current messages on."""
        subscription.stalled = False
        for publisher in subscription.matched.values():
            if publisher.waits_for_readers:
                self._attach(publisher, subscription)
        self._routes.flush()  # a GRANT is followed by no report

    def confirm_credit(self, peer: Peer, frame: frames.Credit) -> None:
        """Note that a publisher has echoed a CREDIT.

        Raises:
            ProtocolError: The publisher is not this peer's.
        """
        self._routes.publisher(peer, frame.publisher).credit.confirm()

    def hold(self) -> None:
        """Let no publisher, present or future, send more than it has sent."""
        self._held = True
        # KEEP_LAST publishers are stopped by the hold below, too: their readers' credit has no say any more.
        self._routes.reader_credit.remove_all(self._routes.publishers.values())
        for publisher in self._routes.publishers.values():
            self._hold(publisher)

    def _hold(self, publisher: PublisherRecord) -> None:
        # As one more reader that takes nothing: its limit is what has been sent already.
        publisher.credit.limits.add(HOLD, publisher.next_sequence, 0, publisher.credit.bytes)
        self._update_credit(publisher)

    def _update_credit(self, publisher: PublisherRecord) -> None:
        if publisher.credit.update():
            limit = publisher.credit.limit or (None, None)
            self._emit(Send(publisher.peer.id, frames.Credit(publisher.key, *limit)))


def subscription_depth(qos: Qos) -> int | None:
    """Return the depth of a subscription's publisher queues; None if the subscription grants credit."""
    if qos.needs_credit:
        return None
    return BEST_EFFORT_DEPTH if qos.history == KEEP_ALL else qos.depth


def _is_attached(publisher: PublisherRecord, subscription: SubscriptionRecord) -> bool:
    """Return whether a publisher's messages go to a subscription that matches it."""
    if not publisher.opened or subscription.key in publisher.unattached:
        return False
    return not (subscription.stalled and publisher.waits_for_readers)


def _same_type(publisher: PublisherRecord, subscription: SubscriptionRecord) -> bool:
    """Return whether a subscription takes a publisher's type; a raw one has no type and takes every one."""
    return not subscription.type_name or (
        subscription.type_name == publisher.type_name and subscription.type_hash == publisher.type_hash
    )


def _is_strict(publisher: PublisherRecord, subscription: SubscriptionRecord) -> bool:
    return publisher.wants.strict or subscription.wants.strict


def _fits(publisher: PublisherRecord, subscription: SubscriptionRecord) -> bool:
    """Return whether a publisher and a subscription match."""
    if not (may_match(publisher, subscription) and _same_type(publisher, subscription)):
        return False
    return not (
        _is_strict(publisher, subscription) and incompatible_policy(publisher.wants, subscription.wants)
    )
