"""`callboard node list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard node list": "the full names of all nodes",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("-a", "--all", action="store_true", help="also hidden ones, with a leading _")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="only how many there are")
    add_json_option(parser, "one array of nodes: name")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import node_list

    return node_list.run(options)
