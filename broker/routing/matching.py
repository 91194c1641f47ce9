"""Which endpoints may match, and how many: an endpoint beyond the limit is refused before it is matched."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from broker.routing import mirrored

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from broker.routing.records import Endpoint, Peer

EndpointT = TypeVar("EndpointT", bound="Endpoint")


def may_match(one: Endpoint, other: Endpoint) -> bool:
    """Return whether two endpoints may match, whatever their names, types and QoS are."""
    node = one.node
    if node is not None and node.kept_apart and node.kept_apart == other.apart:
        return False
    return not mirrored.cannot_match(one, other)


def exceeds(peer: Peer, others: Collection[EndpointT], fits: Callable[[EndpointT], bool], most: int) -> bool:
    """Return whether a new endpoint would raise the `matches` of its peer above a limit.

    Args:
        peer: The endpoint's peer. A pair with another endpoint of its own counts for both.
        others: All possible counterparts.
        fits: Whether one of them matches.
        most: The limit.
    """
    # Usually far from the limit: then no pair is looked at. A pair within one peer counts twice, hence the 2.
    left = most - peer.matches
    if 2 * len(others) <= left:
        return False
    for other in others:
        if fits(other):
            left -= 1 + (other.peer is peer)
            if left < 0:
                return True
    return False
