"""`callboard pkg executables`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard pkg executables": "what `callboard run` can run, package by package",
    "callboard pkg executables --full-path my_package": "the files of one package's programs",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "package", metavar="PACKAGE", nargs="?", help="default: all packages that depend on callboard"
    )
    parser.add_argument("--full-path", action="store_true", help="print the files instead of the names")
    add_json_option(parser, "a list of package, executable and path")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import pkg

    pkg.list_executables(options)
    return 0
