"""Samples at brokers that never were."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.graph.broker_report import BrokerReport
from actors.graph.snapshot import GraphSnapshot
from actors.tools.overview import Sample
from proto.wire.frames import GraphEntry
from proto.wire.stats import BrokerStats, LinkStats, TopicStats

if TYPE_CHECKING:
    from proto.wire.codes import EntryKind

STRING = "std_msgs/msg/String"


def entry(kind: EntryKind, node: str, name: str = "", type_name: str = STRING) -> tuple[Any, ...]:
    """Return an entry of a graph without its key."""
    return (kind, node, name, type_name if name else "", "RIHS01_0" if name else "", {})


def snapshot(*entries: tuple[Any, ...]) -> GraphSnapshot:
    """Return a graph of these entries."""
    return GraphSnapshot(entries={key: GraphEntry(key, *each) for key, each in enumerate(entries, 1)})


def topic(name: str, **numbers: int) -> TopicStats:
    """Return a topic's numbers: 0 but for those that are given."""
    fields = dict.fromkeys(TopicStats._fields, 0)
    return TopicStats(**{**fields, "name": name, **numbers})  # type: ignore[arg-type]


def link(session: int, *nodes: str, **numbers: Any) -> LinkStats:
    """Return a link's numbers: 0 but for those that are given."""
    fields: dict[str, Any] = dict.fromkeys(LinkStats._fields, 0)
    named = {"session": session, "nodes": nodes, "agent": "made up", "suspended": False}
    return LinkStats(**{**fields, **named, **numbers})


def sample(
    at: float,
    graph: GraphSnapshot,
    *,
    topics: tuple[TopicStats, ...] = (),
    links: tuple[LinkStats, ...] = (),
    **totals: Any,
) -> Sample:
    """Return a sample of a broker that listens since 100."""
    numbers = {"broker": "b1", "stamp_sec": 100.0 + at, "uptime_sec": at, **totals}
    report = BrokerReport(
        totals=BrokerStats(**numbers),
        topics={each.name: each for each in topics},
        links={each.session: each for each in links},
    )
    return Sample(graph, report)
