"""What `callboard pkg create` does, and says in ROS 2's words. No broker is needed."""

from __future__ import annotations

import os
import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING

from actors.cli.errors import USAGE, CommandError
from actors.cli.output import note, say, say_json
from actors.tools.licenses import WITH_TEXT
from actors.tools.maintainer import usual_maintainer
from actors.tools.package import (
    NO_DESCRIPTION,
    NO_LICENSE,
    VERSION,
    InvalidPackageError,
    NewPackage,
    comes_with_callboard,
)

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> None:
    """Write the package, and say what it is and which files are new."""
    if options.license == "?":
        say("\n".join(["Supported licenses:", *WITH_TEXT]))
        return
    new = _described(options)
    parent = options.destination_directory
    folder = _at(parent, new.name)
    if os.path.lexists(folder):
        raise CommandError(
            f"\nAborted!\nThe directory already exists: {folder}\n"
            "Either remove the directory or choose a different destination directory or package name"
        )
    if not options.json:
        _say_summary(options, new)
    written = new.write(Path(parent))
    if options.json:
        files = [path.removeprefix(f"{new.name}/") for path in written if not path.endswith("/")]
        say_json({"package": new.name, "directory": str(Path(folder).absolute()), "files": files})
    else:
        for path in written:
            what = "creating folder" if path.endswith("/") else "creating"
            say(f"{what} {_at(parent, path.rstrip('/'))}")
    _say_what_to_mind(options, new)
    if not options.json:
        note(f"\nNow install it: pip install -e {shlex.quote(folder)}")


def _described(options: argparse.Namespace) -> NewPackage:
    usual = usual_maintainer()
    chosen = {
        "description": options.description or NO_DESCRIPTION,
        "license_name": options.license or NO_LICENSE,
        "maintainer_name": options.maintainer_name or usual.name,
        "maintainer_email": options.maintainer_email or usual.email,
    }
    try:
        return NewPackage(
            name=options.package,
            node_name=options.node_name,
            dependencies=tuple(each for each in options.dependencies if not comes_with_callboard(each)),
            year=time.localtime().tm_year,
            **chosen,
        )
    except InvalidPackageError as error:
        raise CommandError(str(error), USAGE) from None


def _say_summary(options: argparse.Namespace, new: NewPackage) -> None:
    say("going to create a new package")
    say(f"package name: {new.name}")
    say(f"destination directory: {Path(options.destination_directory).resolve()}")
    say("package format: pyproject.toml")
    say(f"version: {VERSION}")
    say(f"description: {new.description}")
    say(f"maintainer: {[f'{new.maintainer_name} <{new.maintainer_email}>']}")
    say(f"licenses: {[new.license_name]}")
    say(f"build type: {options.build_type}")
    say(f"dependencies: {options.dependencies}")
    if new.node_name is not None:
        say(f"node_name: {new.node_name}")


def _say_what_to_mind(options: argparse.Namespace, new: NewPackage) -> None:
    ours = [each for each in options.dependencies if comes_with_callboard(each)]
    if ours:
        note(f"\nNothing is to be installed for {', '.join(ours)}: callboard has it.")
    if new.license_text() is None:
        note(
            f"\n[WARNING]: Unknown license '{new.license_name}'.  This has been set in the pyproject.toml, "
            "but no LICENSE file has been created.\nIt is recommended to use one of these license "
            "identifiers:\n" + "\n".join(WITH_TEXT)
        )


def _at(parent: str, path: str) -> str:
    """Return where a path in `parent` is, as ROS 2 writes it: "./my_robot", which pathlib would cut."""
    return os.path.join(parent, *path.split("/"))  # noqa: PTH118
