"""`callboard pkg executables`."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.pkg import NONE_FOUND, require_package
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard pkg executables": "what `callboard run` can run, package by package",
    "callboard pkg executables --full-path my_package": "the files of one package's programs",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", nargs="?", help="default: all packages of `pkg list`")
    parser.add_flag("--full-path", help="print the files instead of the names")
    add_json_option(parser, "a list of package, executable and path")


def run(options: Options) -> int:
    """Print the programs of one package, or of all that `pkg list` lists."""
    from actors.cli.output import print_err, print_json, print_out
    from actors.tools.executables import packages

    if options.package is not None:
        chosen = [require_package(options.package, f"Package '{options.package}' not found")]
    else:
        chosen = [each for each in packages() if each.is_listed]
        if not chosen:
            print_err(NONE_FOUND)
    found = [executable for package in chosen for executable in package.executables()]
    if options.json:
        print_json(
            [
                {"package": each.package, "executable": each.name, "path": each.path and str(each.path)}
                for each in found
            ]
        )
        return 0
    for each in found:
        if not options.full_path:
            print_out(f"{each.package} {each.name}")
        elif each.path is not None:
            print_out(str(each.path))
        else:
            run_it = f"callboard run {each.package} {each.name}"
            print_err(f"There is no file for it, but this runs it: {run_it}")
    return 0
