"""`callboard interface package`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface package std_srvs": "the types of one package",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="such as std_msgs")
    add_json_option(parser, "one array of names")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_list

    return interface_list.package(options)
