"""`callboard topic echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, add_qos_options, count_or_zero, positive

if TYPE_CHECKING:
    import argparse

SHOWN_LENGTH: Final = 128
"""What is shown of a string or sequence, as in ROS 2."""
EXAMPLES: Final = {
    "callboard topic echo /chatter": "every message, until Ctrl-C",
    "callboard topic echo /odom --field pose.pose.position --once": "a part of one message",
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
    parser.add_argument("--once", action="store_true", help="print one message and end")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC", help="end with 124 when no message comes for this long"
    )
    parser.add_argument(
        "--field", metavar="PATH", help="only this part, such as pose.position.x or points[0]"
    )
    parser.add_argument("--raw", action="store_true", help="the bytes as they travel (msgpack)")
    parser.add_argument("--csv", action="store_true", help="the values, separated by commas")
    parser.add_argument("--flow-style", action="store_true", help="each message in one line")
    parser.add_argument("--no-arr", action="store_true", help="describe arrays rather than print them")
    parser.add_argument("--no-str", action="store_true", help="describe strings rather than print them")
    parser.add_argument("-f", "--full-length", action="store_true", help="cut nothing short")
    parser.add_argument(
        "-l", "--truncate-length", type=count_or_zero, metavar="N", default=SHOWN_LENGTH,
        help=f"cut strings and arrays to this length; default: {SHOWN_LENGTH}",
    )  # fmt: skip
    add_json_option(parser, "one document a line, never cut short")
    add_qos_options(parser)
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_echo

    return topic_echo.run(options)
