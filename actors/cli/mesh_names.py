"""The names of a mesh's brokers, for verbs that print the graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot
    from actors.tools.broker_names import BrokerNames


def read_broker_names(inspector: Inspector, snapshot: GraphSnapshot) -> BrokerNames | None:
    """Return the names of the brokers if the mesh has several; else None, and nothing should be printed.

    Without a mesh it asks the broker nothing.
    """
    if not any(entry.broker for entry in snapshot.entries.values()):
        return None
    from actors.tools.broker_names import BrokerNames  # noqa: PLC0415 - few graphs have several brokers

    names = BrokerNames(inspector.report())
    return names if names.several else None
