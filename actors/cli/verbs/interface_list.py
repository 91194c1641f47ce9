"""`callboard interface list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option, add_kind_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface list": "all types: callboard's, installed ones, and those in the current directory",
    "callboard interface list -s": "only services",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_kind_options(parser)
    add_json_option(parser, "one array of names")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_list

    return interface_list.list_all(options)
