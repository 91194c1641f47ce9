"""`callboard pkg list|executables|prefix`: the installed packages. No broker is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.output import note, say, say_json
from actors.tools.executables import find_package, packages
from actors.tools.suggestions import did_you_mean

if TYPE_CHECKING:
    import argparse

    from actors.tools.executables import Executable, Package

_NONE: Final = "No installed package uses callboard; to make one: callboard pkg create --node-name NODE NAME"


def list_packages(options: argparse.Namespace) -> None:
    """Print the packages that use callboard, or all that have programs."""
    found = [each for each in packages() if each.uses_callboard or (options.all and each.executables())]
    if options.json:
        say_json([{"name": each.name, "version": each.version} for each in found])
        return
    for each in found:
        say(each.name)
    if not found:
        note(_NONE)


def list_executables(options: argparse.Namespace) -> None:
    """Print the programs of one package, or of all that use callboard."""
    if options.package is None:
        of = [each for each in packages() if each.uses_callboard]
        if not of:
            note(_NONE)
    else:
        of = [_named(options.package, "Package '{}' not found")]
    found = [executable for package in of for executable in package.executables()]
    if options.json:
        say_json([_as_json(each) for each in found])
        return
    for each in found:
        if not options.full_path:
            say(f"{each.package} {each.name}")
        elif each.path is not None:
            say(str(each.path))
        else:
            note(f"There is no file for it, but this runs it: callboard run {each.package} {each.name}")


def _as_json(executable: Executable) -> dict[str, str | None]:
    return {
        "package": executable.package,
        "executable": executable.name,
        "path": None if executable.path is None else str(executable.path),
    }


def say_prefix(options: argparse.Namespace) -> None:
    """Print where a package is installed, or where its data is."""
    package = _named(options.package, "Package not found")
    prefix, share = package.prefix(), package.share()
    if options.json:
        folder = None if share is None else str(share)
        say_json({"package": package.name, "prefix": str(prefix), "share": folder})
    elif not options.share:
        say(str(prefix))
    elif share is None:
        raise CommandError(f"Package '{package.name}' has no folder of its own")
    else:
        say(str(share))


def _named(name: str, otherwise: str) -> Package:
    found = find_package(name)
    if found is None:
        raise CommandError(otherwise.format(name) + did_you_mean(name, [each.name for each in packages()]))
    return found
