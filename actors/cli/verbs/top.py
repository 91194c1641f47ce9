"""`callboard top`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, positive

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard top": "topics, nodes and services as they work, until q",
    "callboard top --once": "the same as plain tables, of one second",
    "callboard top --json --interval 10": "one document every ten seconds, until Ctrl-C",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--interval", type=positive, metavar="SEC", default=1.0, help="time between two looks; default: 1"
    )
    parser.add_argument("--once", action="store_true", help="print tables of two looks, and end")
    parser.add_argument(
        "--filter", metavar="TEXT", default="", help="only what has this in its name, type or state"
    )
    parser.add_argument("--include-hidden", action="store_true", help="also names with a leading _")
    add_json_option(
        parser, "one document a look, or a single one with --once: seconds, totals, topics, nodes, services"
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import top

    return top.run(options)
