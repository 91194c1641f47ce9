"""`callboard action info`."""

from __future__ import annotations

from typing import Final

from actors.cli.named import ACTION, types_shown
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

EXAMPLES: Final = {
    "callboard action info /fibonacci": "which nodes are its clients and servers",
    "callboard action info -t /fibonacci": "also the type that each of them uses",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("action", metavar="ACTION", help=f"such as {ACTION.example}")
    parser.add_flag("-t", "--show-types", help="also the type that each node uses")
    parser.add_flag("-c", "--count", help="only how many clients and servers there are")
    add_json_option(parser, "one object: name, types, clients, servers")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the clients and servers of an action; one that nobody has has none, as in ROS 2."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.output import print_json
    from actors.cli.tables import Styled, print_styled
    from actors.tools.graph_documents import action_nodes

    name = ACTION.full_name(options.action)
    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
    found = {side: action_nodes(snapshot, side.kind, name) for side in ACTION.sides}
    if options.json:
        types = dict(ACTION.names_and_types(snapshot)).get(name, [])
        lists = {f"{side.noun}s": owners for side, owners in found.items()}
        print_json({"name": name, "types": types, **lists})
        return 0
    print_styled("Action: ", Styled(name, "name"))
    for side, owners in found.items():
        print_styled(f"{side.heading}: ", Styled(str(len(owners)), "heading"))
        if not options.count:
            for each in owners:
                shown = types_shown(each["types"]) if options.show_types else ()
                print_styled("    ", Styled(each["node"], "name"), *shown)
    return 0
