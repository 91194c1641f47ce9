"""`callboard topic find`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic find std_msgs/msg/String": "all topics of this type",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    parser.add_argument("-c", "--count-topics", action="store_true", help="only how many there are")
    parser.add_argument("--include-hidden-topics", action="store_true", help="also names with a leading _")
    add_json_option(parser, "one array of names")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_find

    return topic_find.run(options)
