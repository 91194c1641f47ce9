"""`callboard node list`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

EXAMPLES: Final = {"callboard node list": "the full names of all nodes"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_flag("-a", "--all", help="also hidden ones, with a leading _")
    parser.add_flag("-c", "--count-nodes", help="only how many there are")
    add_json_option(parser, "one array of nodes: name")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the nodes' full names."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.node_names import visible_nodes, warn_of_shared_names
    from actors.cli.output import print_json
    from actors.cli.tables import Styled, print_styled

    with open_inspector(options) as inspector:
        found = visible_nodes(inspector.graph(), hidden=options.all)
    if options.count_nodes:
        print_json(len(found))
    elif options.json:
        print_json([{"name": name} for name in found])
    else:
        for name in found:
            print_styled(Styled(name, "name"))
    warn_of_shared_names(found)
    return 0
