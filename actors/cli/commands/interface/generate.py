"""`callboard interface generate`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard interface generate my_interfaces": "classes for my_interfaces/msg/*.msg, srv and action",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "directory", metavar="DIR", type=Path, help="named as the package, with msg, srv, action"
    )
    parser.add_argument(
        "--output", metavar="DIR", type=Path, help="where the Python package goes; default: into DIR itself"
    )
    add_json_option(parser)


def run(options: Options) -> int:
    """Write classes, and print which files."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_names
    from actors.interfaces import generator

    if not options.directory.is_dir():
        raise CommandError(f"No directory '{options.directory}'")
    print_names(map(str, generator.generate(options.directory, options.output)), json=options.json)
    return 0
