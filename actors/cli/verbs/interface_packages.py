"""`callboard interface packages`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option, add_kind_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard interface packages": "all packages with types",
    "callboard interface packages -a": "those with actions",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_kind_options(parser)
    add_json_option(parser, "one array of names")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import interface_list

    return interface_list.packages(options)
