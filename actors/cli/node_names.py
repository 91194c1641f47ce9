"""The names of nodes that verbs print, and the warning if nodes share one."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from actors.cli.output import print_err
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.graph.snapshot import GraphSnapshot


def visible_nodes(snapshot: GraphSnapshot, *, hidden: bool) -> list[str]:
    """Return the names of nodes, without hidden ones unless they are wanted."""
    return [name for name in snapshot.nodes() if hidden or not is_hidden(name)]


def warn_of_shared_names(names: list[str], places: Mapping[str, str] | None = None) -> None:
    """Print a warning to stderr if names of nodes occur more than once.

    Args:
        names: The names.
        places: The brokers of names that should be unique.
    """
    brokers = {name: f" on {place}" for name, place in (places or {}).items()}
    shared = [
        f"{name} ({number}{brokers.get(name, '')})" for name, number in Counter(names).items() if number > 1
    ]
    if shared:
        print_err(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, which can have"
            f" unintended side effects: {', '.join(shared)}"
        )
