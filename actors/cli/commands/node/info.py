"""`callboard node info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.named import absolute, unknown
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option
from proto.codes import EntryKind
from proto.names import is_hidden

if TYPE_CHECKING:
    from actors.cli.errors import CommandError
    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot, NamesAndTypes

EXAMPLES: Final = {"callboard node info /talker": "what it publishes, subscribes to, serves and calls"}
_KINDS: Final = {
    "Subscribers": EntryKind.SUBSCRIPTION,
    "Publishers": EntryKind.PUBLISHER,
    "Service Servers": EntryKind.SERVICE,
    "Service Clients": EntryKind.CLIENT,
}
_ACTIONS: Final = {"Action Servers": EntryKind.SERVICE, "Action Clients": EntryKind.CLIENT}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", help="such as /talker")
    parser.add_flag("--include-hidden", help="also topics, services and actions with a leading _")
    add_json_option(
        parser, "one object: name, subscribers, publishers, service_servers, service_clients and so on"
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print what a node publishes, subscribes to, serves and calls."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.mesh_names import read_broker_names
    from actors.cli.output import print_err, print_json

    if not options.node.strip("/"):
        raise CommandError("Which node? Write its full name, such as /talker", USAGE)
    name = absolute(options.node)
    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
        number = snapshot.nodes().count(name)
        if not number:
            raise _missing(inspector, name, snapshot)
        names = read_broker_names(inspector, snapshot)
    if number > 1:
        print_err(
            f'There are {number} nodes in the graph with the exact name "{name}".'
            " You are seeing information about all of them."
        )
    sections = _sections(snapshot, name, hidden=options.include_hidden)
    broker = "" if names is None else names.joined(snapshot.node_brokers()[name])
    if options.json:
        lists = {
            heading.lower().replace(" ", "_"): [{"name": each, "types": types} for each, types in names]
            for heading, names in sections.items()
        }
        print_json({"name": name, **({"broker": broker} if broker else {}), **lists})
    else:
        _print(name, broker, sections)
    return 0


def _sections(snapshot: GraphSnapshot, node: str, *, hidden: bool) -> dict[str, NamesAndTypes]:
    from actors.graph.snapshot import actions_among

    found = {heading: snapshot.names_and_types(kind, node=node) for heading, kind in _KINDS.items()}
    for heading, kind in _ACTIONS.items():
        found[heading] = actions_among(snapshot.names_and_types(kind, node=node))
    return {
        heading: [each for each in names if hidden or not is_hidden(each[0])]
        for heading, names in found.items()
    }


def _print(node: str, broker: str, sections: dict[str, NamesAndTypes]) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled(Styled(node, "name"))
    if broker:
        print_styled("  ", Styled("Broker: ", "heading"), broker)
    for heading, names in sections.items():
        print_styled("  ", Styled(f"{heading}:", "heading"))
        for name, types in names:
            print_styled("    ", name, ": ", Styled(", ".join(types), "type"))
        if not names:
            print()  # as ROS 2 prints it


def _missing(inspector: Inspector, name: str, snapshot: GraphSnapshot) -> CommandError:
    from actors.cli.errors import CommandError

    for link in inspector.report().links.values():
        if link.suspended and name in link.nodes:
            silent = f"nothing has come from it for {link.silent_ms / 1000:.1f} s"
            return CommandError(
                f"Node '{name}' is suspended: {silent}; it returns when its link answers again"
            )
    return unknown(f"Unable to find node '{name}'", name, snapshot.nodes())
