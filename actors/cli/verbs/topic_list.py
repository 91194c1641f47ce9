"""`callboard topic list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic list -t": "all topics, with their types",
    "callboard topic list -v": "also how many publishers and subscriptions each has",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count-topics", action="store_true", help="only how many there are")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="with types and how many publishers and subscriptions"
    )
    parser.add_argument("--include-hidden-topics", action="store_true", help="also names with a leading _")
    add_json_option(
        parser, "one array of topics: name, types; with -v also publisher_count, subscription_count"
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_list

    return topic_list.run(options)
