"""`callboard service list`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names_list import list_names
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print the services that have a server."""
    return list_names(
        options,
        EntryKind.SERVICE,
        hidden=options.include_hidden_services,
        types=options.show_types,
        only_count=options.count_services,
    )
