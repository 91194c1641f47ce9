"""`callboard service type`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names import service_name
from actors.cli.names_list import say_types
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a service's types."""
    return say_types(
        options,
        "service",
        service_name(options.service),
        EntryKind.SERVICE,
        hidden=options.include_hidden_services,
    )
