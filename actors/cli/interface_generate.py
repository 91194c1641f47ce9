"""`callboard interface generate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.errors import CommandError
from actors.cli.output import say, say_json
from actors.interfaces import generator

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Write classes, and print which files."""
    if not options.directory.is_dir():
        raise CommandError(f"No directory '{options.directory}'")
    written = [str(path) for path in generator.generate(options.directory, options.output)]
    if options.json:
        say_json(written)
        return 0
    for path in written:
        say(path)
    return 0
