"""`callboard service echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_print_options, add_qos_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard service echo /add_two_ints": "what becomes of its calls, as far as its ends tell",
    "callboard service echo /add_two_ints --flow-style": "an event a line",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="SERVICE", help="such as /add_two_ints")
    parser.add_argument(
        "type",
        metavar="TYPE",
        nargs="?",
        help="such as example_interfaces/srv/AddTwoInts; with it, a service may be yet to come",
    )
    add_print_options(parser)
    add_qos_options(parser)
    add_broker_options(parser)
    parser.set_defaults(field=None, filter=None, raw=False, include_message_info=False)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import service_echo

    return service_echo.run(options)
