"""`callboard topic type`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic type /chatter": "its type",
    "callboard topic type /chatter | callboard interface show -": "the definition of its type",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument("--include-hidden-topics", action="store_true", help="also names with a leading _")
    add_json_option(parser, "one array of types")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_type

    return topic_type.run(options)
