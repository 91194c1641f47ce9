"""`callboard pkg list`."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.pkg import NONE_FOUND
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {"callboard pkg list": "the installed packages that depend on callboard, or are of ROS 2"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_flag("-a", "--all", help="also other packages that `callboard run` can run")
    add_json_option(parser, "a list of name and version")


def run(options: Options) -> int:
    """Print the packages that use callboard, or all that have programs."""
    from actors.cli.output import print_err, print_json, print_names
    from actors.tools.executables import packages

    found = [each for each in packages() if each.is_listed or (options.all and each.executables())]
    if options.json:
        print_json([{"name": each.name, "version": each.version} for each in found])
        return 0
    print_names(each.name for each in found)
    if not found:
        print_err(NONE_FOUND)
    return 0
