"""The brokers of a mesh, for verbs that print the graph or measure topics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.named import TOPIC
from proto.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.cli.parsing import Options
    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot
    from actors.tools.broker_names import BrokerNames


def broker_names(inspector: Inspector, snapshot: GraphSnapshot) -> BrokerNames | None:
    """Return the names of the brokers if the mesh has several; else None, and nothing should be printed.

    Without a mesh it asks the broker nothing.
    """
    if not any(entry.broker for entry in snapshot.entries.values()):
        return None
    from actors.tools.broker_names import BrokerNames  # noqa: PLC0415 - few graphs have several brokers

    names = BrokerNames(inspector.report())
    return names if names.several else None


def publishes_elsewhere(options: Options, topics: Iterable[str]) -> bool:
    """Return whether topics have publishers of other brokers of the mesh.

    A broker gets and counts their messages only while its own nodes subscribe.
    """
    from actors.cli.broker_target import open_inspector  # noqa: PLC0415 - `--help` needs none

    names = set(map(TOPIC.full_name, topics))
    with open_inspector(options) as inspector:
        entries = inspector.graph().of_kind(EntryKind.PUBLISHER)
        brokers = {entry.broker for entry in entries if entry.name in names}
        return any(brokers) and brokers != {next(iter(inspector.report().brokers), 0)}
