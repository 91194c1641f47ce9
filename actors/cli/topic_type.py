"""`callboard topic type`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names import topic_name
from actors.cli.names_list import say_types
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a topic's types."""
    return say_types(
        options,
        "topic",
        topic_name(options.topic),
        EntryKind.PUBLISHER,
        EntryKind.SUBSCRIPTION,
        hidden=options.include_hidden_topics,
    )
