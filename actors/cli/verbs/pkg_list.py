"""`callboard pkg list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard pkg list": "the installed packages that depend on callboard",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "-a", "--all", action="store_true", help="also other packages that `callboard run` can run"
    )
    add_json_option(parser, "a list of name and version")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import pkg

    pkg.list_packages(options)
    return 0
