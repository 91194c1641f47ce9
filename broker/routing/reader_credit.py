"""Credit of KEEP_ALL subscriptions for KEEP_LAST publishers (docs/protocol.md §6.5.8).

It holds back no publisher. Messages without credit wait in the queue between the publisher and the
subscription's link, which drops the oldest beyond the publisher's depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing.deliveries import Resume
from broker.routing.flow_control import CreditLimits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.routing.deliveries import Delivery
    from broker.routing.records import PublisherRecord, Route, SubscriptionRecord
    from proto.wire import frames


class ReaderCredit:
    """The limits of the queues in one graph.

    Args:
        emit: Takes each delivery.
    """

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit

    def add(self, publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
        """Send an attached subscription no more than it grants.

        The limit holds for its link, and so for the link's other subscriptions to the publisher.
        """
        route = publisher.routes[subscription.peer.id]
        route.queue.keeps_credit = True
        if route.limits is None:
            route.limits = CreditLimits()
        # The ATTACHED follows what is queued. Its numbers may be greater: of the publisher's earlier session.
        first = max(publisher.first_for(subscription), route.queue.end_sequence)
        limit = first + subscription.window_messages
        route.limits.add(subscription.key, limit, subscription.window_bytes, route.queue.bytes_put)
        self._update(route)

    def grant(
        self, publisher: PublisherRecord, subscription: SubscriptionRecord, frame: frames.Grant
    ) -> None:
        """Raise the limit of a subscription."""
        route = publisher.routes.get(subscription.peer.id)
        if route is not None and route.limits is not None:
            route.limits.grant(subscription.key, frame.sequence_limit, frame.byte_limit)
            self._update(route)

    def remove(self, route: Route, subscription: SubscriptionRecord) -> None:
        """Remove the limit of a subscription that leaves, if it has one."""
        if route.limits is not None and route.limits.remove(subscription.key):
            self._update(route, trim=True)

    def remove_all(self, publishers: Iterable[PublisherRecord]) -> None:
        """Send everything that has been accepted, as the broker stops."""
        for publisher in publishers:
            for route in publisher.routes.values():
                route.limits = None
                self._update(route)

    def _update(self, route: Route, *, trim: bool = False) -> None:
        least = None if route.limits is None else route.limits.least()
        route.queue.sequence_limit, route.queue.byte_limit = least or (None, None)
        self._emit(Resume(route.peer.id, route.queue, trim))
