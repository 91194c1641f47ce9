"""`callboard interface list`: names, without importing a class."""

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
    "callboard interface list": "all types: callboard's, installed ones, and those in the current directory",
    "callboard interface list -s": "only services",
}
_HEADINGS: Final = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_kind_options(parser)
    add_json_option(parser, "one array of names")


def run(options: Options) -> int:
    """Print all types, by kind."""
    from actors.cli.output import print_json, print_out
    from actors.cli.tables import Styled, print_styled
    from actors.interfaces.catalog import interfaces_of, known_packages

    import_from_working_directory()
    every = [name for package in known_packages() for name in interfaces_of(package)]
    by_kind = {kind: [name for name in every if f"/{kind}/" in name] for kind in chosen_kinds(options)}
    if options.json:
        print_json([name for names in by_kind.values() for name in names])
        return 0
    for kind, names in by_kind.items():
        print_styled(Styled(_HEADINGS[kind], "heading"))
        for name in names:
            print_out(f"    {name}")
    return 0
