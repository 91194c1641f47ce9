"""`callboard service find`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names_list import find_names
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print the services of a type."""
    return find_names(
        options,
        EntryKind.SERVICE,
        hidden=options.include_hidden_services,
        only_count=options.count_services,
    )
