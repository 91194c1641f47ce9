"""`callboard interface package`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import (
    Options,
    Parser,
    add_json_option,
    add_kind_options,
    chosen_kinds,
    import_from_working_directory,
)

EXAMPLES: Final = {
    "callboard interface package std_srvs": "the types of one package",
    "callboard interface package -m sensor_msgs": "only its messages",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="such as std_msgs")
    add_kind_options(parser)
    add_json_option(parser, "one array of names")


def run(options: Options) -> int:
    """Print the types of a package."""
    from actors.cli.output import print_names
    from actors.interfaces.catalog import interfaces_of

    import_from_working_directory()
    kinds = chosen_kinds(options)
    found = [name for name in interfaces_of(options.package) if name.split("/")[1] in kinds]
    print_names(found, json=options.json)
    return 0
