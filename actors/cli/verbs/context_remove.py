"""`callboard context remove`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard context remove robot": "forget that broker",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", help="its name")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import context

    return context.remove(options)
