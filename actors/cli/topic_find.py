"""`callboard topic find`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names_list import find_names
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print the topics of a type."""
    return find_names(
        options,
        EntryKind.PUBLISHER,
        EntryKind.SUBSCRIPTION,
        hidden=options.include_hidden_topics,
        only_count=options.count_topics,
    )
