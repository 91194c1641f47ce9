"""`callboard service call`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, positive

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard service call /add_two_ints example_interfaces/srv/AddTwoInts '{a: 5, b: 3}'": (
        "one call; the answer is printed"
    ),
    "callboard service call --stdin /add_two_ints example_interfaces/srv/AddTwoInts --json": (
        'a call for each line such as {"a": 5, "b": 3}, a line for each answer'
    ),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="NAME", help="such as /add_two_ints")
    parser.add_argument("type", metavar="TYPE", help="such as example_interfaces/srv/AddTwoInts")
    parser.add_argument("values", metavar="VALUES", nargs="?", help="a YAML map: '{a: 5, b: 3}'; default: {}")
    parser.add_argument(
        "--stdin",
        action="store_true",
        help="call with what comes on stdin, one after the other: YAML with --- in between, or a JSON object "
        "a line",
    )
    parser.add_argument(
        "-r",
        "--rate",
        type=positive,
        metavar="HZ",
        help="call again and again; with --stdin, at most so often",
    )
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help="end with 124 when no server comes, or no reply, within this time; default: for a reply 60",
    )  # fmt: skip
    add_json_option(parser, "the response alone")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import service_call

    return service_call.run(options)
