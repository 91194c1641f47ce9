"""The brokers of a mesh, as the broker sees them that a command is connected with."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.errors import CommandError
from proto.wire.codes import EntryKind
from proto.wire.mesh_keys import broker_id

if TYPE_CHECKING:
    from actors.graph.broker_report import BrokerReport
    from actors.graph.inspector import Inspector
    from proto.wire.stats import MeshBrokerStats

MEASURING_SEC: Final = 1.0
"""How long to wait for the answers of all brokers, from which the round trips are known."""
SETTLED_SEC: Final = 0.25
"""How long to go on measuring."""
PAUSE_SEC: Final = 0.05

HERE: Final = "here"
ROUTES: Final = {HERE: "this broker", "direct": "direct", "indirect": "indirect"}


class Row(NamedTuple):
    """A broker.

    Attributes:
        stats: Its statistics.
        route: A key of ROUTES.
        nodes, endpoints: How many are in the graph; endpoints are publishers, subscriptions and so on.
    """

    stats: MeshBrokerStats
    route: str
    nodes: int
    endpoints: int

    @property
    def id(self) -> str:
        """Its id."""
        return broker_id(self.stats.number)

    @property
    def round_trip(self) -> str:
        """The time to it and back, as text."""
        if self.route == HERE:
            return "-"
        return f"{self.stats.round_trip_us / 1000:.2f} ms" if self.stats.round_trip_us else "?"


def rows_of(inspector: Inspector) -> list[Row]:
    """Return the brokers, the one that answers first, with fresh round trips.

    Raises:
        CommandError: The broker has not joined a mesh.
    """
    snapshot, report = inspector.graph(), measured(inspector)
    nodes = Counter(entry.broker for entry in snapshot.of_kind(EntryKind.NODE))
    endpoints = Counter(entry.broker for entry in snapshot.entries.values())
    here = next(iter(report.brokers))
    return [
        Row(
            stats,
            HERE if number == here else "direct" if stats.direct else "indirect",
            nodes[number],
            endpoints[number] - nodes[number],
        )
        for number, stats in report.brokers.items()
    ]


def measured(inspector: Inspector) -> BrokerReport:
    """Return a report with the round trips to all brokers, as far as they answer within `MEASURING_SEC`.

    The first request for a report lets the broker measure. The first measurement takes longer than others,
    since Zenoh learns where the broker is.

    Raises:
        CommandError: The broker has not joined a mesh.
    """
    began = time.monotonic()
    while True:
        report = inspector.report()
        if not report.brokers:
            text = "has not joined a mesh; start it with --mesh-listen or --mesh (callboard broker --help)"
            raise CommandError(f"The broker at {inspector.url} {text}")
        _, *others = report.brokers.values()
        spent = time.monotonic() - began
        known = all(each.round_trip_us for each in others)
        if not others or spent > (SETTLED_SEC if known else MEASURING_SEC):
            return report
        time.sleep(PAUSE_SEC)


def document_of(row: Row) -> dict[str, Any]:
    """Return a broker for JSON."""
    trip = row.stats.round_trip_us
    return {
        "name": row.stats.name,
        "id": row.id,
        "version": row.stats.version,
        "nodes": row.nodes,
        "endpoints": row.endpoints,
        "round_trip_sec": trip / 1e6 if trip else None,
        "route": row.route,
    }
