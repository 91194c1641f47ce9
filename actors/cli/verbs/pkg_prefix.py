"""`callboard pkg prefix`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard pkg prefix my_package": "the environment that it is installed in",
    "callboard pkg prefix --share my_package": "the folder that its data is in, such as launch files",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="its name")
    parser.add_argument("--share", action="store_true", help="print the folder with its modules and data")
    add_json_option(parser, "an object with package, prefix and share")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import pkg

    pkg.say_prefix(options)
    return 0
