"""`callboard lifecycle nodes`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options

EXAMPLES: Final = {"callboard lifecycle nodes": "the full names of all nodes with states"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_flag("-a", "--all", "--include-hidden-nodes", help="also hidden ones, with a leading _")
    parser.add_flag("-c", "--count-nodes", help="only how many there are")
    add_json_option(parser, "one array of nodes: name")
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the full names of nodes with states."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.node_names import visible_nodes, warn_of_shared_names
    from actors.cli.output import print_json
    from actors.cli.tables import Styled, print_styled
    from proto.wire.codes import EntryKind

    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
    served = dict(snapshot.names_and_types(EntryKind.SERVICE))
    found = [
        name
        for name in visible_nodes(snapshot, hidden=options.all)
        if "lifecycle_msgs/srv/GetState" in served.get(f"{name}/get_state", ())
    ]
    if options.count_nodes:
        print_json(len(found))
    elif options.json:
        print_json([{"name": name} for name in found])
    else:
        for name in found:
            print_styled(Styled(name, "name"))
    warn_of_shared_names(found)
    return 0
