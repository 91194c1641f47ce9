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

    `copies`, each message once for every link it was routed to, equals `accounted` at every moment. Each of
    its terms is counted on its own, where it happens.
    """

    connections: int
    endpoints: int
    """Nodes, publishers, subscriptions, services and clients."""
    routed: int
    """Messages that reached at least one link."""
    copies: int
    delivered: int
    """Copies handed whole to a link's transport."""
    dropped: int
    """Copies dropped because a link was slower than its depth allows."""
    abandoned: int
    """Copies that waited when their last reader on the link left or was suspended."""
    lost_on_break: int
    """Copies that waited for a link that ended, or came while it was ending."""
    leaving: int
    """Copies of which some fragments are with the transport, and not yet the last."""
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

    @property
    def accounted(self) -> int:
        """Copies of which it is known what has become of them: all."""
        return (
            self.delivered + self.dropped + self.abandoned + self.lost_on_break + self.leaving + self.queued
        )


def collect(connections: int, routers: Iterable[Router]) -> BrokerStats:
    """Return the numbers of all graphs of a broker together."""
    graphs = list(routers)
    topics = [router.topics for router in graphs]
    services = [router.services for router in graphs]
    tallies = [topic.tallies()[0] for topic in topics]
    return BrokerStats(
        connections=connections,
        endpoints=sum(len(router.graph) for router in graphs),
        routed=sum(topic.routed for topic in topics),
        copies=sum(topic.copies for topic in topics),
        delivered=sum(tally.delivered for tally in tallies),
        dropped=sum(tally.dropped for tally in tallies),
        abandoned=sum(tally.abandoned for tally in tallies),
        lost_on_break=sum(tally.lost_on_break for tally in tallies),
        leaving=sum(tally.leaving for tally in tallies),
        queued=sum(tally.queued for tally in tallies),
        unmatched=sum(topic.unmatched for topic in topics),
        stale=sum(topic.stale for topic in topics),
        calls=sum(service.calls for service in services),
        refused_calls=sum(service.refused for service in services),
        pending_calls=sum(service.pending for service in services),
        late_replies=sum(service.late for service in services),
    )
