"""`callboard topic info`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.endpoints import Side, show_info
from actors.cli.names import topic_name
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a topic's type, and who publishes and subscribes."""
    return show_info(
        options,
        "topic",
        topic_name(options.topic),
        Side(EntryKind.PUBLISHER, "publishers", "Publisher count"),
        Side(EntryKind.SUBSCRIPTION, "subscriptions", "Subscription count"),
    )
