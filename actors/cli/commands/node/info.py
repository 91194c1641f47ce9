"""`callboard node info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.named import absolute, unknown
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options

if TYPE_CHECKING:
    from actors.cli.errors import CommandError
    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot

EXAMPLES: Final = {"callboard node info /talker": "what it publishes, subscribes to, serves and calls"}
_HEADINGS: Final = (
    "Subscribers",
    "Publishers",
    "Service Servers",
    "Service Clients",
    "Action Servers",
    "Action Clients",
)


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", help="such as /talker")
    parser.add_flag("--include-hidden", help="also topics, services and actions with a leading _")
    add_json_option(
        parser, "one object: name, subscribers, publishers, service_servers, service_clients and so on"
    )
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print what a node publishes, subscribes to, serves and calls."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.mesh_names import read_broker_names
    from actors.cli.output import print_err, print_json
    from actors.tools import graph_documents

    if not options.node.strip("/"):
        raise CommandError("Which node? Write its full name, such as /talker", USAGE)
    name = absolute(options.node)
    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
        names = read_broker_names(inspector, snapshot)
        found = graph_documents.node(snapshot, name, names, hidden=options.include_hidden)
        if found is None:
            raise _missing(inspector, name, snapshot)
    number = snapshot.nodes().count(name)
    if number > 1:
        print_err(
            f'There are {number} nodes in the graph with the exact name "{name}".'
            " You are seeing information about all of them."
        )
    if options.json:
        print_json(found)
    else:
        _print(found)
    return 0


def _print(node: dict[str, Any]) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled(Styled(node["name"], "name"))
    if "broker" in node:
        print_styled("  ", Styled("Broker: ", "heading"), node["broker"])
    for label, text in node.get("labels", {}).items():
        print_styled("  ", Styled(f"Label {label}: ", "heading"), text)
    for heading in _HEADINGS:
        print_styled("  ", Styled(f"{heading}:", "heading"))
        found = node[heading.lower().replace(" ", "_")]
        for each in found:
            print_styled("    ", each["name"], ": ", Styled(", ".join(each["types"]), "type"))
        if not found:
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
