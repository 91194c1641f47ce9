"""What a broker has done and holds, as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from broker.router import Router


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerStats:
    """A snapshot.

    While no link breaks, `copies == delivered + dropped + abandoned + queued`, where copies counts each
    message once for every link it was routed to.
    """

    connections: int
    endpoints: int
    """Nodes, publishers, subscriptions, services and clients."""
    routed: int
    """Messages that reached at least one link."""
    copies: int
    delivered: int
    """Copies handed to a link's transport."""
    dropped: int
    """Copies dropped because a link was slower than its depth allows."""
    abandoned: int
    """Copies that waited when their last reader left."""
    queued: int
    """Copies that wait now."""
    unmatched: int
    """Messages that nobody was there to hear."""
    stale: int
    """Messages discarded because they had been seen."""
    calls: int
    refused_calls: int
    pending_calls: int
    late_replies: int


def collect(connections: int, routers: Iterable[Router]) -> BrokerStats:
    """Return the numbers of all graphs of a broker together."""
    graphs = list(routers)
    topics = [router.topics for router in graphs]
    services = [router.services for router in graphs]
    lanes = [lane for topic in topics for lane in topic.all_lanes()]
    queued = sum(lane.pending for lane in lanes)
    dropped = sum(lane.dropped for lane in lanes) + sum(topic.retired_dropped for topic in topics)
    abandoned = sum(topic.abandoned for topic in topics)
    copies = sum(topic.copies for topic in topics)
    return BrokerStats(
        connections=connections,
        endpoints=sum(len(router.graph) for router in graphs),
        routed=sum(topic.routed for topic in topics),
        copies=copies,
        delivered=copies - dropped - abandoned - queued,
        dropped=dropped,
        abandoned=abandoned,
        queued=queued,
        unmatched=sum(topic.unmatched for topic in topics),
        stale=sum(topic.stale for topic in topics),
        calls=sum(service.calls for service in services),
        refused_calls=sum(service.refused for service in services),
        pending_calls=sum(service.pending for service in services),
        late_replies=sum(service.late for service in services),
    )
