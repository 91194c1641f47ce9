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
    """Write classes, import them in another process, and print which files were written."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_names, print_warning
    from actors.interfaces import generator
    from actors.interfaces.import_check import check_import

    source: Path = options.directory
    if not source.is_dir():
        raise CommandError(f"No directory '{source}'")
    written = generator.generate(source, options.output)
    package = source.resolve().name
    missing = check_import(source if options.output is None else options.output / package, written)
    if missing:
        needed = ", ".join(missing)
        print_warning(f"{package} needs other packages, which cannot be imported here yet: {needed}")
    print_names(map(str, written), json=options.json)
    return 0
