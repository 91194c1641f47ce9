"""`callboard context use`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard context use robot": "go to that broker from now on",
    "callboard context use default": "go to callboard://127.0.0.1:7411 again",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", help="its name")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import context

    return context.use(options)
