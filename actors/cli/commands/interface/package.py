"""`callboard interface package`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option, import_from_working_directory

EXAMPLES: Final = {"callboard interface package std_srvs": "the types of one package"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="such as std_msgs")
    add_json_option(parser, "one array of names")


def run(options: Options) -> int:
    """Print the types of a package."""
    from actors.cli.output import print_names
    from actors.interfaces.catalog import interfaces_of

    import_from_working_directory()
    print_names(interfaces_of(options.package), json=options.json)
    return 0
