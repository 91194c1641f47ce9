"""`callboard pkg create`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard pkg create --node-name talker my_package": "a package with one node, ready to be installed",
    "callboard pkg create my_package --license MIT --dependencies 'numpy>=2'": "with a LICENSE file",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
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
    parser.add_argument("--package-format", type=int, choices=(2, 3), help="ignored: there is no package.xml")
    add_json_option(parser, "an object with package, directory and files")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import pkg_create

    pkg_create.run(options)
    return 0
