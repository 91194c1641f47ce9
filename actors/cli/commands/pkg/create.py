"""`callboard pkg create`: a new package of nodes, with ROS 2's texts. No broker is needed."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import Options, Parser, add_json_option

if TYPE_CHECKING:
    from actors.tools.package import NewPackage

EXAMPLES: Final = {
    "callboard pkg create --node-name talker my_package": "a package with one node, ready to be installed",
    "callboard pkg create my_package --license MIT --dependencies 'numpy>=2'": "with a LICENSE file",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "package", metavar="NAME", help="lowercase letters, digits and underscores; a new folder of this name"
    )
    parser.add_argument(
        "--build-type",
        choices=("python", "ament_python"),
        default="python",
        help="the same, whichever is chosen: a Python package with a pyproject.toml",
    )
    parser.add_argument("--node-name", metavar="NODE", help="a node to begin with, and the program for it")
    parser.add_argument(
        "--dependencies", metavar="PACKAGE", nargs="+", default=[], help="what pip installs with it"
    )
    parser.add_argument(
        "--license", metavar="LICENSE", help="its SPDX identifier; '?' prints those that come with their text"
    )
    parser.add_argument("--description", metavar="TEXT", help="what the package is, in one line")
    parser.add_argument("--maintainer-name", metavar="TEXT", help="default: git's user.name, or the login")
    parser.add_argument("--maintainer-email", metavar="ADDRESS", help="default: git's user.email")
    parser.add_argument(
        "--destination-directory", metavar="DIR", default=os.curdir, help="where the folder goes; default: ."
    )
    parser.add_argument(
        "--package-format",
        "--package_format",
        type=int,
        choices=(2, 3),
        help="ignored: there is no package.xml",
    )
    add_json_option(parser, "an object with package, directory and files")


def run(options: Options) -> int:
    """Write the package, and print its attributes and files."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_err, print_json, print_out
    from actors.tools.licenses import WITH_TEXT

    if options.license == "?":
        print_out("\n".join(["Supported licenses:", *WITH_TEXT]))
        return 0
    new = _new_package(options)
    parent = options.destination_directory
    folder = _at(parent, new.name)
    if os.path.lexists(folder):
        raise CommandError(
            f"\nAborted!\nThe directory already exists: {folder}\n"
            "Either remove the directory or choose a different destination directory or package name"
        )
    if not options.json:
        _print_summary(options, new)
    written = new.write(Path(parent))
    if options.json:
        files = [path.removeprefix(f"{new.name}/") for path in written if not path.endswith("/")]
        print_json({"package": new.name, "directory": str(Path(folder).absolute()), "files": files})
    else:
        for path in written:
            what = "creating folder" if path.endswith("/") else "creating"
            print_out(f"{what} {_at(parent, path.rstrip('/'))}")
    _print_warnings(options, new)
    if not options.json:
        print_err(f"\nNow install it: pip install -e {shlex.quote(folder)}")
    return 0


def _new_package(options: Options) -> NewPackage:
    import time

    from actors.cli.errors import USAGE, CommandError
    from actors.tools.maintainer import usual_maintainer
    from actors.tools.package import (
        NO_DESCRIPTION,
        NO_LICENSE,
        InvalidPackageError,
        NewPackage,
        comes_with_callboard,
    )

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


def _print_summary(options: Options, new: NewPackage) -> None:
    from actors.cli.output import print_out
    from actors.tools.package import VERSION

    lines = {
        "package name": new.name,
        "destination directory": Path(options.destination_directory).resolve(),
        "package format": "pyproject.toml",
        "version": VERSION,
        "description": new.description,
        "maintainer": [f"{new.maintainer_name} <{new.maintainer_email}>"],
        "licenses": [new.license_name],
        "build type": options.build_type,
        "dependencies": options.dependencies,
        **({} if new.node_name is None else {"node_name": new.node_name}),
    }
    print_out(
        "\n".join(["going to create a new package", *(f"{what}: {is_}" for what, is_ in lines.items())])
    )


def _print_warnings(options: Options, new: NewPackage) -> None:
    from actors.cli.output import print_err
    from actors.tools.licenses import WITH_TEXT
    from actors.tools.package import comes_with_callboard

    ours = [each for each in options.dependencies if comes_with_callboard(each)]
    if ours:
        print_err(f"\nNothing is to be installed for {', '.join(ours)}: callboard has it.")
    if new.license_text() is None:
        print_err(
            f"\n[WARNING]: Unknown license '{new.license_name}'.  This has been set in the pyproject.toml, "
            "but no LICENSE file has been created.\nIt is recommended to use one of these license "
            "identifiers:\n" + "\n".join(WITH_TEXT)
        )


def _at(parent: str, path: str) -> str:
    """Return where a path in `parent` is, as ROS 2 writes it: "./my_robot", which pathlib would cut."""
    return os.path.join(parent, *path.split("/"))  # noqa: PTH118
