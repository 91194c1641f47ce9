"""A broker's numbers at one moment, as data: what `Node.get_broker_stats` and `Inspector.report` return."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

from actors.graph.snapshot import require_few
from proto.untrusted_text import peer_name, peer_text
from proto.wire import frames
from proto.wire.stats import (
    BrokerRates,
    BrokerStats,
    LinkStats,
    MeshBrokerStats,
    MeshStats,
    TopicStats,
    increase,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

TOPIC_TOTALS: Final = (
    "messages",
    "bytes",
    "delivered",
    "dropped",
    "abandoned",
    "lost_on_break",
    "by_reference",
)
LINK_TOTALS: Final = ("dropped", "bytes_received", "bytes_sent", "shared_bytes_received", "shared_bytes_sent")
"""Counts that only grow while a topic or a link exists."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerReportRates:
    """Rates: counts per second between two reports.

    Attributes:
        totals: In the whole broker.
        topics: By name: messages, bytes, delivered, dropped, abandoned, lost_on_break, by_reference.
        links: By session: dropped, bytes_received, bytes_sent, shared_bytes_received, shared_bytes_sent.
    """

    totals: BrokerRates
    topics: dict[str, dict[str, float]]
    links: dict[int, dict[str, float]]

    def as_dict(self) -> dict[str, Any]:
        """Return the rates as plain data.

        Returns:
            Dicts and numbers.
        """
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerReport:
    """A broker at one moment.

    Attributes:
        totals: The whole broker, all domains together.
        topics: The topics of the asking node's domain, by name.
        links: The links of the asking node's domain, by session.
        brokers: The mesh's brokers in the asking node's domain, by number; the first is the asked one. Empty
            without a mesh.
        mesh: Counts of what the broker has exchanged with the others.
    """

    totals: BrokerStats
    topics: dict[str, TopicStats]
    links: dict[int, LinkStats]
    brokers: dict[int, MeshBrokerStats] = field(default_factory=dict[int, MeshBrokerStats])
    mesh: MeshStats = field(default_factory=MeshStats)

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data.

        Returns:
            Dicts, tuples, strings and numbers.
        """
        return {
            "totals": self.totals.as_dict(),
            "topics": {name: topic._asdict() for name, topic in self.topics.items()},
            "links": {session: link._asdict() for session, link in self.links.items()},
            "brokers": {number: broker._asdict() for number, broker in self.brokers.items()},
            "mesh": self.mesh.as_dict(),
        }

    def rates_since(self, earlier: BrokerReport) -> BrokerReportRates:
        """Return what has happened per second since an earlier report of the same broker.

        A topic or a link that did not exist then counts from zero; those that are gone are not included.

        Args:
            earlier: The earlier report.

        Returns:
            Rates in all, by topic and by link.

        Raises:
            ValueError: `earlier` is not earlier, or another broker's.
        """
        totals = self.totals.rates_since(earlier.totals)
        return BrokerReportRates(
            totals=totals,
            topics=_rates(TOPIC_TOTALS, earlier.topics, self.topics, totals.interval_sec),
            links=_rates(LINK_TOTALS, earlier.links, self.links, totals.interval_sec),
        )


def _rates(
    totals: Sequence[str], earlier: Mapping[Any, object], later: Mapping[Any, object], seconds: float
) -> dict[Any, dict[str, float]]:
    rates: dict[Any, dict[str, float]] = {}
    for key, entry in later.items():
        rise = increase(totals, earlier.get(key), entry)  # its counts may have started again
        rates[key] = {total: change / seconds for total, change in rise.items()}
    return rates


@dataclass(slots=True)
class ReportParts:
    """The parts of a broker's answer received so far."""

    complete: bool = False
    totals: frames.Options = field(default_factory=dict[str, frames.Scalar])
    topics: dict[str, TopicStats] = field(default_factory=dict[str, TopicStats])
    links: dict[int, LinkStats] = field(default_factory=dict[int, LinkStats])
    brokers: dict[int, MeshBrokerStats] = field(default_factory=dict[int, MeshBrokerStats])
    mesh: frames.Options = field(default_factory=dict[str, frames.Scalar])

    def add(self, frame: frames.Stats) -> None:
        """Add a part."""
        # A report may take several frames, each with a part of the maps.
        self.totals = {**self.totals, **frame.totals}
        self.mesh = {**self.mesh, **frame.mesh}
        for topic in frame.topics:
            name = peer_name(topic.name)
            self.topics[name] = topic._replace(name=name)
        for link in frame.links:
            nodes = tuple(map(peer_name, link.nodes))
            self.links[link.session] = link._replace(agent=peer_text(link.agent), nodes=nodes)
        for broker in frame.brokers:
            name, version = peer_text(broker.name), peer_text(broker.version)
            self.brokers[broker.number] = broker._replace(name=name, version=version)
        # After each part: the limit must hold before the whole answer is here.
        require_few(len(self.totals) + len(self.topics) + len(self.links) + len(self.brokers))
        self.complete = not frame.more

    def report(self) -> BrokerReport:
        """Return the report, when it is complete."""
        return BrokerReport(
            totals=BrokerStats.from_map(self.totals),
            topics=self.topics,
            links=self.links,
            brokers=self.brokers,
            mesh=MeshStats.from_map(self.mesh),
        )
