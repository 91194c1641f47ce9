"""`callboard node info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.names import node_name, unknown
from actors.cli.output import say_json
from actors.cli.place import inspector
from actors.cli.tables import Styled, say_styled
from actors.graph.snapshot import actions_among
from proto.codes import EntryKind
from proto.names import is_hidden

if TYPE_CHECKING:
    import argparse

    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot, NamesAndTypes

_KINDS: Final = {
    "Subscribers": EntryKind.SUBSCRIPTION,
    "Publishers": EntryKind.PUBLISHER,
    "Service Servers": EntryKind.SERVICE,
    "Service Clients": EntryKind.CLIENT,
}
_ACTIONS: Final = {"Action Servers": EntryKind.SERVICE, "Action Clients": EntryKind.CLIENT}


def run(options: argparse.Namespace) -> int:
    """Print what a node publishes, subscribes to, serves and calls."""
    name = node_name(options.node)
    with inspector(options) as look:
        snapshot = look.graph()
        if name not in snapshot.nodes():
            raise _missing(look, name, snapshot)
    sections = _sections(snapshot, name, hidden=options.include_hidden)
    if options.json:
        say_json(_document(name, sections))
    else:
        _say(name, sections)
    return 0


def _sections(snapshot: GraphSnapshot, node: str, *, hidden: bool) -> dict[str, NamesAndTypes]:
    found = {heading: snapshot.names_and_types(kind, node=node) for heading, kind in _KINDS.items()}
    for heading, kind in _ACTIONS.items():
        found[heading] = actions_among(snapshot.names_and_types(kind, node=node))
    return {
        heading: [each for each in names if hidden or not is_hidden(each[0])]
        for heading, names in found.items()
    }


def _document(node: str, sections: dict[str, NamesAndTypes]) -> dict[str, object]:
    document: dict[str, object] = {"name": node}
    for heading, names in sections.items():
        key = heading.lower().replace(" ", "_")
        document[key] = [{"name": name, "types": types} for name, types in names]
    return document


def _say(node: str, sections: dict[str, NamesAndTypes]) -> None:
    say_styled(Styled(node, "name"))
    for heading, names in sections.items():
        say_styled("  ", Styled(f"{heading}:", "heading"))
        for name, types in names:
            say_styled("    ", name, ": ", Styled(", ".join(types), "type"))
        if not names:
            print()  # ROS 2's sign of none


def _missing(look: Inspector, name: str, snapshot: GraphSnapshot) -> CommandError:
    for link in look.report().links.values():
        if link.suspended and name in link.nodes:
            silent = f"nothing has come from it for {link.silent_ms / 1000:.1f} s"
            return CommandError(f"Node '{name}' is suspended: {silent}; it is back when it is heard again")
    return unknown(f"Unable to find node '{name}'", name, snapshot.nodes())
