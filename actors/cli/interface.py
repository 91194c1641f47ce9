"""`callboard interface`: show, list, package, generate. No broker is needed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.output import say, say_json
from actors.cli.parsing import add_json_option, add_verbs

if TYPE_CHECKING:
    import argparse

_HEADINGS: Final = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the verbs."""
    add = add_verbs(parser)
    show = add("show", "print the definition of a type")
    show.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    add_json_option(show)
    add_json_option(add("list", "list the types that come with callboard"))
    package = add("package", "list the types of a package")
    package.add_argument("package", metavar="PACKAGE", help="such as std_msgs")
    add_json_option(package)
    generate = add("generate", "write Python classes for a package of .msg, .srv and .action files")
    generate.add_argument(
        "directory", metavar="DIR", type=Path, help="named as the package, with msg, srv, action"
    )
    generate.add_argument(
        "--output", metavar="DIR", type=Path, help="where the Python package goes; default: into DIR itself"
    )
    add_json_option(generate)


def run(options: argparse.Namespace) -> int:
    """Run the verb that was chosen."""
    verbs = {"show": _show, "list": _list, "package": _package, "generate": _generate}
    verbs[options.verb](options)
    return 0


def _show(options: argparse.Namespace) -> None:
    from actors.cli.values import named_interface  # noqa: PLC0415 - `--help` needs no types
    from actors.interfaces.message import type_name  # noqa: PLC0415
    from actors.interfaces.registry import source_of  # noqa: PLC0415

    found = named_interface(options.type)
    text = source_of(found)
    if options.json:
        say_json({"name": type_name(found), "definition": text})
    else:
        say(text.rstrip("\n"))


def _list(options: argparse.Namespace) -> None:
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


def _package(options: argparse.Namespace) -> None:
    from actors.cli.values import look_here  # noqa: PLC0415
    from actors.interfaces.registry import interfaces_of  # noqa: PLC0415

    look_here()
    names = interfaces_of(options.package)
    if options.json:
        say_json(names)
        return
    for name in names:
        say(name)


def _generate(options: argparse.Namespace) -> None:
    from actors.interfaces.generator import generate  # noqa: PLC0415

    if not options.directory.is_dir():
        raise CommandError(f"No directory '{options.directory}'")
    written = [str(path) for path in generate(options.directory, options.output)]
    if options.json:
        say_json(written)
        return
    for path in written:
        say(path)
