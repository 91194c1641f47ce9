"""`callboard broker`: the daemon, as `python -m broker` runs it."""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Final

from actors.cli.interrupts import raise_at_once
from broker import command

if TYPE_CHECKING:
    import argparse


EXAMPLES: Final = {
    "callboard broker": "listen on callboard://127.0.0.1:7411, until Ctrl-C",
    "callboard broker --host 0.0.0.0 --auth access.toml": "for other machines: for the users in that file",
    "callboard broker --config broker.toml": "with the options in a file",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags."""
    command.add_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    # The daemon would import these itself, when a signal already raises.
    import_module("broker.daemon")
    with suppress(ImportError):
        import_module("uvloop")
    raise_at_once()
    return command.run(options)
