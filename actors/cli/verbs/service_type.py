"""`callboard service type`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard service type /add_two_ints": "its type",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="SERVICE", help="such as /add_two_ints")
    parser.add_argument("--include-hidden-services", action="store_true", help="also names with a leading _")
    add_json_option(parser, "one array of types")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import service_type

    return service_type.run(options)
