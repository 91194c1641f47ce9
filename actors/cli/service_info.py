"""`callboard service info`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.endpoints import Side, show_info
from actors.cli.names import service_name
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a service's type, and who serves and calls it."""
    return show_info(
        options,
        "service",
        service_name(options.service),
        Side(EntryKind.CLIENT, "clients", "Clients count"),
        Side(EntryKind.SERVICE, "servers", "Services count"),
    )
