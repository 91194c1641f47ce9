"""`callboard node list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options

if TYPE_CHECKING:
    from actors.cli.tables import Cell

EXAMPLES: Final = {"callboard node list": "the full names of all nodes"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_flag("-a", "--all", help="also hidden ones, with a leading _")
    parser.add_flag("-c", "--count-nodes", help="only how many there are")
    add_json_option(parser, "one array of nodes: name; in a mesh also broker, duplicate; labels, if any")
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the nodes' full names; in a mesh with their brokers; labels of those that have some."""
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
    documents = graph_documents.nodes(snapshot, brokers, hidden=options.all)
    if brokers is not None:
        duplicates = snapshot.duplicate_nodes()
        places = {name: brokers.joined(numbers) for name, numbers in duplicates.items()}
    if options.json:
        print_json(documents)
    else:
        print_table(map(_row, documents), style=("name", "dim", "warn"))
    warn_of_shared_names(found, places)
    return 0


def _row(node: dict[str, Any]) -> list[Cell]:
    """Return the line of a node: its name alone, as in ROS 2, if there is nothing else to tell."""
    from actors.cli.tables import Styled
    from actors.graph.snapshot import labels_text

    cells: list[Cell] = [node["name"]]
    if "broker" in node:
        cells.append(node["broker"])
        cells += ["duplicate"] if node["duplicate"] else []
    if "labels" in node:
        cells.append(Styled(labels_text(node["labels"]), "dim"))
    return cells
