"""The router's interface for the mesh: endpoints of other brokers, mirrored in this broker's graph.

The router treats a mesh as one more peer. The mesh sends it the frames of nodes and the tuples below:
mirrored endpoints keep the keys that their own brokers gave them, and `Open` comes before the messages of a
publisher. Where mirrored endpoints need other treatment than those of a link, the parts of the router use the
functions below, so that all special cases are here. Most follow from one rule: the broker of an endpoint
enforces what concerns it (its name, its rights, its credit), and all others believe that broker.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

from proto.wire import frames

if TYPE_CHECKING:
    from broker.routing.records import (
        Endpoint,
        Peer,
        PublisherRecord,
        Route,
        ServiceRecord,
        SubscriptionRecord,
    )


class Mirror(NamedTuple):
    """Declares an endpoint that another broker has accepted.

    Attributes:
        declaration: Its frame, with an id that the mesh chooses, and the public gid of a publisher.
        key: Its key at the other broker.
    """

    declaration: Any
    key: int


class Open(NamedTuple):
    """The messages of another broker's publisher arrive from now on.

    Attributes:
        publisher: Its key.
        next_sequence: The number of the first message.
        live_sequence: Messages with smaller numbers are latched ones.
        subscriptions: Keys of those for which nothing is left out from `live_sequence` on.
    """

    publisher: int
    next_sequence: int
    live_sequence: int
    subscriptions: tuple[int, ...]


class Forward(NamedTuple):
    """Requests to the server with this key, which another broker has chosen."""

    server: int
    request: frames.Request


Mirrored: TypeAlias = Mirror | Open | Forward


class ExportListener(Protocol):
    """Learns which endpoints of this broker are in the graph, to tell other brokers."""

    def allows(self, endpoint: Endpoint) -> bool:
        """Return whether other brokers may know an endpoint."""
        ...

    def joined(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is new or back."""
        ...

    def left(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is gone or suspended."""
        ...

    def retired(self, server: ServiceRecord) -> None:
        """Note a server that gets no more requests and may answer those that it has."""
        ...


def is_checked_elsewhere(peer: Peer) -> bool:
    """Return whether other brokers have checked what a peer sends: names, public gids and credit."""
    return peer.mesh


def cannot_match(one: Endpoint, other: Endpoint) -> bool:
    """Return whether two endpoints cannot match because of the brokers that they belong to.

    Endpoints of two other brokers are matched there, and no other broker may know a private one.
    """
    return (one.mirrored and (other.mirrored or other.private)) or (other.mirrored and one.private)


# Latched messages: a broker gets those of a publisher once, keeps them, and gives its own late joiners what
# they want.


def least_depth(peer: Peer, publisher: PublisherRecord) -> int:
    """Return the least depth of a publisher's queue for a peer."""
    return publisher.keep if peer.mesh else 1


def wants_latched(route: Route, subscription: SubscriptionRecord) -> bool:
    """Return whether the publisher's latched messages follow when a subscription has been attached.

    Another broker gets them with the first of its subscriptions, whatever that one wants.
    """
    if not subscription.mirrored:
        return subscription.wants.latched
    return _first_of_broker(route, subscription.broker) is subscription


def latched_messages_for(publisher: PublisherRecord, subscription: SubscriptionRecord) -> int:
    """Return how many of the latest latched messages a subscription gets."""
    if subscription.depth is None or subscription.mirrored:
        return publisher.latched_messages
    return min(subscription.depth, publisher.latched_messages)


def successor(route: Route, subscription: SubscriptionRecord) -> SubscriptionRecord | None:
    """Return the subscription that gets the rest of the latched messages instead of one that has left."""
    return _first_of_broker(route, subscription.broker) if subscription.mirrored else None


def _first_of_broker(route: Route, broker: int) -> SubscriptionRecord | None:
    """Return the subscription of a broker that was attached before its others; None if it has none."""
    return next((each for each in route.subscriptions.values() if each.broker == broker), None)


# Credit: a publisher's own broker limits it, by the limits of its readers at all brokers.


def close_without_readers(publisher: PublisherRecord) -> bool:
    """Close a mirrored publisher whose last reader here has left, as its broker stops sending then.

    Returns:
        Whether it was closed.
    """
    if not publisher.mirrored or publisher.matched:
        return False
    publisher.opened = False
    return True


def await_attachment(publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
    """Note that a new KEEP_ALL reader gets all messages only once the publisher's broker has attached it."""
    if publisher.mirrored and publisher.waits_for_readers and subscription.depth is None:
        publisher.unattached.add(subscription.key)


def limits_keep_last(subscription: SubscriptionRecord) -> bool:
    """Return whether a KEEP_ALL subscription limits what KEEP_LAST publishers send to its peer.

    One of another broker does not, as the readers of all brokers share one peer; its own broker does that.
    """
    return not subscription.mirrored


def grant_elsewhere(
    publisher: PublisherRecord, subscription: SubscriptionRecord, frame: frames.Grant
) -> frames.Grant | None:
    """Return the GRANT for the broker that limits a publisher; None if this one does."""
    if not (publisher.mirrored and publisher.waits_for_readers):
        return None
    return frames.Grant(subscription.number, frame.publisher, frame.sequence_limit, frame.byte_limit)


def brokers_of(route: Route) -> set[int]:
    """Return the numbers of the other brokers whose subscriptions a route serves."""
    return {each.broker for each in route.subscriptions.values() if each.mirrored}
