"""`callboard context list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard context list": "the named brokers; * marks the one in use",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    add_json_option(parser, "a list of {name, url, domain, description, current}")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import context

    return context.list_contexts(options)
