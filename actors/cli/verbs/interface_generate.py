"""`callboard interface generate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface generate my_interfaces": "classes for my_interfaces/msg/*.msg, srv and action",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "directory", metavar="DIR", type=Path, help="named as the package, with msg, srv, action"
    )
    parser.add_argument(
        "--output", metavar="DIR", type=Path, help="where the Python package goes; default: into DIR itself"
    )
    add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_generate

    return interface_generate.run(options)
