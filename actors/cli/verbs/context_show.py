"""`callboard context show`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard context show": "where commands and nodes go now, and why",
    "callboard context show robot": "where they would go with --context robot",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", nargs="?", help="its name; default: what counts now")
    add_json_option(parser, "{url, domain, url_from, domain_from}")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import context

    return context.show(options)
