"""`callboard topic`: list, echo, pub."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from actors.cli.parsing import (
    add_broker_options,
    add_json_option,
    add_qos_options,
    add_verbs,
    count,
    count_or_zero,
    positive,
)

if TYPE_CHECKING:
    import argparse

SHOWN_LENGTH = 128
"""What `echo` shows of a string or sequence, as ROS 2 does."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the verbs."""
    add = add_verbs(parser)
    _list_arguments(add("list", "list topics"))
    _echo_arguments(add("echo", "print the messages of a topic"))
    _pub_arguments(add("pub", "publish on a topic"))


def _list_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count-topics", action="store_true", help="only how many there are")
    parser.add_argument("--include-hidden-topics", action="store_true", help="also names with a leading _")
    add_json_option(parser)
    add_broker_options(parser)


def _echo_arguments(parser: argparse.ArgumentParser) -> None:
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


def _pub_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    parser.add_argument(
        "values", metavar="VALUES", nargs="?", default="{}", help="a YAML map: '{data: hello}'"
    )
    parser.add_argument("-r", "--rate", type=positive, metavar="HZ", default=1.0, help="a second; default: 1")
    times = parser.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", action="store_true", help="wait for a subscription, publish once, end")
    times.add_argument("-t", "--times", type=count, metavar="N", help="publish N times and end")
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=count_or_zero, metavar="N",
        help="wait for N subscriptions first; default: 1 with --once and --times, else 0",
    )  # fmt: skip
    parser.add_argument(
        "--timeout",
        type=positive,
        metavar="SEC",
        help="end with 124 when they have not come within this time",
    )
    parser.add_argument("-p", "--print", type=count, metavar="N", default=1, help="print every Nth message")
    add_json_option(parser, "one document a line")
    add_qos_options(parser)
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run the verb that was chosen; its code is imported only now."""
    module: Any = import_module(f"actors.cli.topic_{options.verb}")
    code: int = module.run(options)
    return code
