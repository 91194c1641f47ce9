"""Invariants of every step of a history: checked after each loop turn in which frames have moved.

Counters account for each copy that a broker has routed, each message that a publisher has published and each
message that is due to a subscription, at any moment and under any fault. Checking everything in every turn
would take most of the time, so only the changed parts are checked, and the structure behind the sums
(`seams/structure.py`) in every `DEEP`th such turn. Single frames are checked when they are sent or received
(`frame_checks.py`).
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final
from unittest import mock

from actors.endpoints.endpoint import endpoint_of
from broker.server import Broker
from broker.serving.dispatcher import Dispatcher
from proto.aio.channel import Channel
from proto.wire.session import Role
from tests.seams import simulation as seams
from tests.seams import structure
from tests.seams.brokers import dispatcher_of
from tests.simulation.frame_checks import FrameChecks

if TYPE_CHECKING:
    from collections.abc import Iterator

    from broker.options import BrokerOptions
    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router
    from broker.server import Broker
    from proto.queues.publisher_queue import PublisherQueue
    from tests.simulation.records import PublisherHistory, SubscriptionHistory
    from tests.simulation.world import World

DEEP: Final = 100
"""So many turns in which something has moved to one check of the structure."""

SUBSCRIPTION_COUNTS: Final = (
    "received",
    "dropped",
    "lost",
    "lost_on_break",
    "expired",
    "undecodable",
    "queued",
)


class Complained(Exception):  # noqa: N818 - it is a verdict, not an error of the loop
    """A history ends because of its first complaint."""


class Steps:
    """Checks a world after each turn of its loop.

    Attributes:
        checks: Turns in which something had moved.
        until_complaint: Whether the first complaint ends the history.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._brokers_moved = self._nodes_moved = False
        self._publishers: dict[PublisherHistory, None] = {}
        self._subscriptions: dict[SubscriptionHistory, None] = {}
        self._depths: dict[PublisherQueue, float] = {}
        """By publisher queue with messages, the greatest depth it has had since it last kept its depth."""
        self._frame_checks = FrameChecks(world)
        self.checks = 0
        self.until_complaint = False

    def add_publisher(self, pub: PublisherHistory) -> None:
        """Check this publisher, too."""
        self._publishers[pub] = None

    def add_subscription(self, sub: SubscriptionHistory) -> None:
        """Check this subscription, too."""
        self._subscriptions[sub] = None

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Check after each loop turn while inside."""
        flush, deliver = Channel.flush, Dispatcher.deliver

        def recording_flush(channel: Channel) -> None:
            if channel.session.role is Role.BROKER:
                self._brokers_moved = True
            else:
                self._nodes_moved = True
            flush(channel)

        def recording_deliver(dispatcher: Dispatcher, router: Router, deliveries: list[Delivery]) -> None:
            self._brokers_moved = True
            deliver(dispatcher, router, deliveries)

        self._world.loop.after_turn = self._turn_ended
        try:
            with (
                mock.patch.object(Channel, "flush", recording_flush),
                mock.patch.object(Dispatcher, "deliver", recording_deliver),
                self._frame_checks.installed(),
            ):
                yield
        finally:
            self._world.loop.after_turn = None

    def _turn_ended(self) -> None:
        if self._brokers_moved or self._nodes_moved:
            self.checks += 1
            if self.checks % DEEP == 0:
                self.check_all()
            self.check()
        if self.until_complaint and self._world.journal.complaints:
            self._world.loop.after_turn = None  # what follows only cleans up
            raise Complained

    def check(self) -> None:
        """Check what has moved since the last check."""
        if self._brokers_moved:
            self._brokers_moved = False
            for host, broker in self._brokers():
                for router in dispatcher_of(broker).joined:
                    self._check_routed(host, router)
                for link in dispatcher_of(broker).links:
                    self._check_ceilings(host, link.channel, broker.options)
                self._complain(host, structure.of_suspensions(broker))
        if self._nodes_moved:
            self._nodes_moved = False
            self._frame_checks.check()
            for pub in tuple(self._publishers):
                self._check_published(pub)
        for sub in tuple(self._subscriptions):
            if sub.moved:
                self._check_due(sub)

    def check_routers(self, place: str) -> None:
        """Check the routers of one host, between two messages that it handles in one turn."""
        for host, broker in self._brokers():
            if host == place:
                for router in dispatcher_of(broker).joined:
                    self._check_routed(host, router)

    def check_all(self) -> None:
        """Check everything, moved or not, and the structure behind it."""
        self._brokers_moved = self._nodes_moved = True
        for sub in self._subscriptions:
            sub.moved = True
        self.check()
        for host, broker in self._brokers():
            self._complain(host, structure.of_broker(broker))
        for member in self._world.members:
            if member.alive:
                self._complain(member.host, structure.of_node(member.node))

    def _brokers(self) -> Iterator[tuple[str, Broker]]:
        for process in self._world.brokers:
            if process.broker is not None and process.alive:
                yield process.host, process.broker

    def _complain(self, host: str, wrongs: Iterator[str]) -> None:
        for wrong in wrongs:
            self._world.complain(f"{host}: {wrong}")

    def _check_routed(self, host: str, router: Router) -> None:
        """Each copy is delivered, dropped, abandoned, lost with its link, on its way or queued."""
        routes = router.routes
        tally, _ = routes.tallies()
        for queue, *_ in routes.peer_queues():
            self._check_depth(host, queue)
        known = tally.delivered + tally.dropped + tally.abandoned + tally.lost_on_break
        if routes.copies != known + tally.leaving + tally.queued:
            self._world.complain(f"{host}: {routes.copies} copies were made, and there are {tally}")

    def _check_depth(self, host: str, queue: PublisherQueue) -> None:
        """What waits is no more than the depth and what credit allows, or these when that came."""
        depth = math.inf if queue.depth is None else queue.depth + queue.beyond_depth
        if queue.pending <= depth:
            if queue.pending:
                self._depths[queue] = depth
            else:
                self._depths.pop(queue, None)
            return
        most = self._depths[queue] = max(depth, self._depths.get(queue, 0))
        if queue.pending > most:
            self._world.complain(f"{host}: {queue.pending} messages wait where {most} may")

    def _check_ceilings(self, host: str, channel: Channel, options: BrokerOptions) -> None:
        """More than may does not wait on a link that goes on."""
        if not channel.connected or seams.is_closing(channel):
            return
        outbox = channel.outbox
        for what, waits, most in (
            ("of messages", outbox.held_bytes, options.max_link_bytes),
            ("of small calls and control frames", outbox.undroppable_bytes, options.max_queue_bytes),
            ("of large calls", outbox.bulk_bytes, options.max_bulk_bytes),
        ):
            if waits > most:
                self._world.complain(f"{host}: {waits} bytes {what} wait where {most} may")

    def _check_published(self, pub: PublisherHistory) -> None:
        """Each message, and each that was queued anew for a new broker, is sent, dropped or waits.

        What waits to be sent again when that link breaks, too, is abandoned.
        """
        publisher, queue = pub.publisher, endpoint_of(pub.publisher).queue
        known = queue.sent + queue.leaving + queue.abandoned + publisher.queued + publisher.dropped
        if publisher.published + pub.resent != known:
            self._world.complain(
                f"{pub.name}: published {publisher.published}, {pub.resent} again; sent {queue.sent},"
                f" leaving {queue.leaving}, abandoned {queue.abandoned}, queued {publisher.queued},"
                f" dropped {publisher.dropped}"
            )
        # What a destroyed publisher has still to send is held to the depth at the end of the next turn.
        if queue.depth is not None and queue.pending > queue.depth and not publisher.destroyed:
            self._world.complain(f"{pub.name}: {queue.pending} messages wait where {queue.depth} may")
        if pub.gone:
            del self._publishers[pub]

    def _check_due(self, sub: SubscriptionHistory) -> None:
        """Each message that a publisher has sent while matched is received, queued or counted as lost."""
        subscription = sub.subscription
        # An iterator that has been woken takes what is too much in its next step.
        sub.moved = sub.about_to_take
        if subscription.destroyed or sub.gone:
            del self._subscriptions[sub]
            return
        due = sub.due
        known = sum(getattr(subscription, name) for name in SUBSCRIPTION_COUNTS)
        if due != known:
            counts = {name: getattr(subscription, name) for name in SUBSCRIPTION_COUNTS}
            self._world.complain(f"{sub.name}: {due} messages were due, and there are {counts}")
        # What latched messages may still make good is not reported yet.
        reported = seams.subscription_events(subscription).message_lost.counts[0]
        tracker = endpoint_of(subscription).tracker
        away = (known.missed for gid, known in tracker.known.items() if gid not in tracker.attachments)
        open_ = sum(attachment.missed for attachment in tracker.attachments.values()) + sum(away)
        if reported + open_ != subscription.dropped + subscription.lost + subscription.lost_on_break:
            counts = {name: getattr(subscription, name) for name in SUBSCRIPTION_COUNTS}
            self._world.complain(
                f"{sub.name}: {reported} lost messages were reported, {open_} are open: {counts}"
            )
        depth = endpoint_of(subscription).consumer.depth
        if depth is not None and subscription.queued > depth and not sub.about_to_take:
            self._world.complain(f"{sub.name}: {subscription.queued} messages wait where {depth} may")
