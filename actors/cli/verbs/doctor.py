"""`callboard doctor`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard doctor": "look at everything; 0 if nothing is wrong, 1 if something is",
    "callboard doctor --json": "the same for programs",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_json_option(parser, "a list of {name, status, finding, remedy}; status: ok, warn, fail or skip")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import doctor

    return doctor.run(options)
