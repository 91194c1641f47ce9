"""`callboard interface proto`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface proto geometry_msgs/msg/Twist": "values to fill in for topic pub",
    "callboard interface proto --no-quotes std_srvs/srv/SetBool": "the request of a service, as plain YAML",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "type",
        metavar="TYPE",
        help="such as std_msgs/msg/String; of a service the request, of an action the goal",
    )
    parser.add_argument("--no-quotes", action="store_true", help="without quotes around it")
    add_json_option(parser, "the message as one object")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_proto

    return interface_proto.run(options)
