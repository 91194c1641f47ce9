"""`callboard service info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard service info /add_two_ints": "its type, and how many clients and servers it has",
    "callboard service info -v /add_two_ints": "also which nodes they are on",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="SERVICE", help="such as /add_two_ints")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="also each client and server: node, type hash, QoS"
    )
    add_json_option(parser, "one object: name, types, clients, servers")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import service_info

    return service_info.run(options)
