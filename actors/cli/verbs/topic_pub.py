"""`callboard topic pub`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import (
    add_broker_options,
    add_json_option,
    add_qos_options,
    count,
    count_or_zero,
    positive,
)

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic pub /chatter std_msgs/msg/String '{data: hello}'": "once a second, until Ctrl-C",
    "callboard topic pub --once /chatter std_msgs/msg/String '{data: hello}'": (
        "one message, as soon as somebody listens"
    ),
    "callboard topic pub /head std_msgs/msg/Header '{stamp: now, frame_id: map}' -r 10": (
        "ten a second, each with the time at which it is sent"
    ),
    "callboard topic pub --stdin /copy std_msgs/msg/String": (
        "what stdin says, such as the output of `callboard topic echo --json /chatter`"
    ),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    parser.add_argument(
        "values",
        metavar="VALUES",
        nargs="?",
        help="a YAML map: '{data: hello}'; 'auto' fills in a header, 'now' a time; default: {}",
    )
    parser.add_argument(
        "--stdin",
        action="store_true",
        help="publish what comes on stdin, as it comes: YAML with --- in between, or a JSON object a line",
    )
    _add_times(parser)
    add_json_option(parser, "one document a line")
    add_qos_options(parser)
    add_broker_options(parser)


def _add_times(parser: argparse.ArgumentParser) -> None:
    """Describe when and how often it publishes, and what it prints of that."""
    parser.add_argument(
        "-r", "--rate", type=positive, metavar="HZ", help="a second; default: 1, with --stdin as they come"
    )
    times = parser.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", action="store_true", help="wait for a subscription, publish once, end")
    times.add_argument("-t", "--times", type=count, metavar="N", help="publish N times and end")
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=count_or_zero, metavar="N",
        help="wait for N subscriptions first; default: 1 with --once and --times, else 0",
    )  # fmt: skip
    parser.add_argument(
        "--timeout",
        "--max-wait-time-secs",
        type=positive,
        metavar="SEC",
        help="end with 124 when they have not come within this time",
    )
    parser.add_argument(
        "--keep-alive", type=positive, metavar="SEC", help="stay for this long after the last message"
    )
    parser.add_argument(
        "-n", "--node-name", metavar="NAME", help="the publishing node's; default: a hidden one"
    )
    parser.add_argument("-p", "--print", type=count, metavar="N", default=1, help="print every Nth message")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_pub

    return topic_pub.run(options)
