"""`callboard interface show`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface show geometry_msgs/msg/Twist": "the definition, with its comments",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface

    interface.show(options)
    return 0
