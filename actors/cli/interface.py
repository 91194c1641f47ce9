"""What `callboard interface` does. No broker is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.output import say, say_json

if TYPE_CHECKING:
    import argparse

_HEADINGS: Final = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def show(options: argparse.Namespace) -> None:
    """Print a definition."""
    from actors.cli.values import named_interface  # noqa: PLC0415 - `--help` needs no types
    from actors.interfaces.message import type_name  # noqa: PLC0415
    from actors.interfaces.registry import source_of  # noqa: PLC0415

    found = named_interface(options.type)
    text = source_of(found)
    if options.json:
        say_json({"name": type_name(found), "definition": text})
    else:
        say(text.rstrip("\n"))


def list_all(options: argparse.Namespace) -> None:
    """Print the standard types, by kind."""
    from actors.interfaces.registry import interfaces_of, standard_packages  # noqa: PLC0415

    names = [name for package in standard_packages() for name in interfaces_of(package)]
    if options.json:
        say_json(names)
        return
    for kind, heading in _HEADINGS.items():
        say(heading)
        for name in names:
            if name.split("/")[1] == kind:
                say(f"    {name}")


def package(options: argparse.Namespace) -> None:
    """Print the types of a package."""
    from actors.cli.values import look_here  # noqa: PLC0415
    from actors.interfaces.registry import interfaces_of  # noqa: PLC0415

    look_here()
    names = interfaces_of(options.package)
    if options.json:
        say_json(names)
        return
    for name in names:
        say(name)


def generate(options: argparse.Namespace) -> None:
    """Write classes, and print which files."""
    from actors.interfaces import generator  # noqa: PLC0415

    if not options.directory.is_dir():
        raise CommandError(f"No directory '{options.directory}'")
    written = [str(path) for path in generator.generate(options.directory, options.output)]
    if options.json:
        say_json(written)
        return
    for path in written:
        say(path)
