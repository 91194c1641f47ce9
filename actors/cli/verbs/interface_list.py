"""`callboard interface list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface list": "all types that come with callboard",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface

    interface.list_all(options)
    return 0
