"""`callboard node list`."""

from __future__ import annotations

from collections import Counter
from typing import Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option
from proto.names import is_hidden

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
    from actors.cli.output import print_err, print_json
    from actors.cli.tables import Styled, print_styled

    with open_inspector(options) as inspector:
        found = [name for name in inspector.graph().nodes() if options.all or not is_hidden(name)]
    if options.count_nodes:
        print_json(len(found))
    elif options.json:
        print_json([{"name": name} for name in found])
    else:
        for name in found:
            print_styled(Styled(name, "name"))
    shared = [f"{name} ({number})" for name, number in Counter(found).items() if number > 1]
    if shared:
        print_err(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, which can have"
            f" unintended side effects: {', '.join(shared)}"
        )
    return 0
