"""`callboard topic info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic info /chatter": "its type, and how many publishers and subscriptions it has",
    "callboard topic info -v /chatter": "also which nodes they are on, and their QoS",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument(
        "-v",
        "--verbose",
        action="store_true",
        help="also each publisher and subscription: node, type hash, QoS",
    )
    add_json_option(parser, "one object: name, types, publishers, subscriptions")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_info

    return topic_info.run(options)
