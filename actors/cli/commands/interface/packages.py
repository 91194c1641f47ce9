"""`callboard interface packages`."""

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
    "callboard interface packages": "all packages with types",
    "callboard interface packages -a": "those with actions",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_kind_options(parser)
    add_json_option(parser, "one array of names")


def run(options: Options) -> int:
    """Print the packages that have types of the kinds asked for."""
    from actors.cli.output import print_names
    from actors.interfaces.catalog import interfaces_of, known_packages

    import_from_working_directory()
    kinds = set(chosen_kinds(options))
    found = [
        package
        for package in known_packages()
        if any(name.split("/")[1] in kinds for name in interfaces_of(package))
    ]
    print_names(found, json=options.json)
    return 0
