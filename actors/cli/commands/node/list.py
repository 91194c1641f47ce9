"""`callboard node list`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options
from proto.wire.codes import EntryKind

EXAMPLES: Final = {"callboard node list": "the full names of all nodes"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_flag("-a", "--all", help="also hidden ones, with a leading _")
    parser.add_flag("-c", "--count-nodes", help="only how many there are")
    add_json_option(parser, "one array of nodes: name; in a mesh also broker, duplicate")
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the nodes' full names; in a mesh with their brokers."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.mesh_names import read_broker_names
    from actors.cli.node_names import visible_nodes, warn_of_shared_names
    from actors.cli.output import print_json
    from actors.cli.tables import print_table
    from actors.tools import graph_documents

    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
        brokers = read_broker_names(inspector, snapshot)
    found = visible_nodes(snapshot, hidden=options.all)
    if options.count_nodes:
        print_json(len(found))
        warn_of_shared_names(found)
        return 0
    places: dict[str, str] = {}
    rows: list[tuple[str, ...]] = [(name,) for name in found]
    if brokers is not None:
        entries = snapshot.of_kind(EntryKind.NODE)
        nodes = sorted((entry.node, brokers[entry.broker]) for entry in entries if entry.node in set(found))
        duplicates = snapshot.duplicate_nodes()
        places = {name: brokers.joined(numbers) for name, numbers in duplicates.items()}
        rows = [(*node, *(["duplicate"] if node[0] in duplicates else [])) for node in nodes]
    if options.json:
        print_json(graph_documents.nodes(snapshot, brokers, hidden=options.all))
    else:
        print_table(rows, style=("name", "dim", "warn"))
    warn_of_shared_names(found, places)
    return 0
