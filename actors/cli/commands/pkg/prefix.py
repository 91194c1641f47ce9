"""`callboard pkg prefix`."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.pkg import require_package
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard pkg prefix my_package": "the environment that it is installed in",
    "callboard pkg prefix --share my_package": "the folder that its data is in, such as launch files",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="its name")
    parser.add_flag("--share", help="print the folder with its modules and data")
    add_json_option(parser, "an object with package, prefix and share")


def run(options: Options) -> int:
    """Print where a package is installed, or where its data is."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_json, print_out

    package = require_package(options.package, "Package not found")
    prefix, share = package.prefix(), package.share()
    if options.json:
        print_json({"package": package.name, "prefix": str(prefix), "share": share and str(share)})
    elif not options.share:
        print_out(str(prefix))
    elif share is None:
        raise CommandError(f"Package '{package.name}' has no folder of its own")
    else:
        print_out(str(share))
    return 0
