"""`callboard interface show`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface show geometry_msgs/msg/Twist": "its fields, and those of what it contains",
    "callboard interface show -": "the type that comes from a pipe, as of callboard topic type /chatter",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String; - reads it from a pipe")
    comments = parser.add_mutually_exclusive_group()
    comments.add_argument("--all-comments", action="store_true", help="also those of what it contains")
    comments.add_argument("--no-comments", action="store_true", help="neither comments nor blank lines")
    add_json_option(parser, "one object: name, definition")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_show

    return interface_show.run(options)
