"""`callboard topic echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_print_options, add_qos_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic echo /chatter": "every message, until Ctrl-C",
    "callboard topic echo /odom --field pose.pose.position --once": "a part of one message",
    "callboard topic echo /chatter --filter 'm.data > 3' --csv": "some messages, as comma-separated values",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument(
        "type",
        metavar="TYPE",
        nargs="?",
        help="such as std_msgs/msg/String; with it, a topic may be yet to come",
    )
    parser.add_argument(
        "--field", metavar="PATH", help="only this part, such as pose.position.x or points[0]"
    )
    parser.add_argument(
        "--filter",
        metavar="EXPR",
        help="only messages for which this Python expression about m holds (it is evaluated): 'm.data > 3'",
    )
    parser.add_argument("--raw", action="store_true", help="the bytes as they travel (msgpack)")
    parser.add_argument(
        "--include-message-info", action="store_true", help="with times, number and publisher of each message"
    )
    parser.add_argument("--no-lost-messages", action="store_true", help="say nothing of lost messages")
    add_print_options(parser)
    add_qos_options(parser)
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_echo

    return topic_echo.run(options)
