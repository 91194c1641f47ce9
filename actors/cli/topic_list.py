"""`callboard topic list`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names_list import list_names
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print the topics that have a publisher or a subscription."""
    return list_names(
        options,
        EntryKind.PUBLISHER,
        EntryKind.SUBSCRIPTION,
        hidden=options.include_hidden_topics,
        types=options.show_types,
        only_count=options.count_topics,
    )
