"""`callboard context add`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import domain
from actors.config.environment import MAX_DOMAIN

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard context add robot --url callboard://192.168.1.20:7411": "give a broker a name",
    "callboard context add lab --url callboard://lab --domain 7 --use": "one of its graphs, and go there",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("name", metavar="NAME", help="letters, digits, - and _")
    parser.add_argument("--url", metavar="URL", required=True, help="the broker, or several with commas")
    parser.add_argument("--domain", type=domain, metavar="N", help=f"which of its graphs, 0 to {MAX_DOMAIN}")
    parser.add_argument("--description", metavar="TEXT", default="", help="one line, for people")
    parser.add_argument("--use", action="store_true", help="go there from now on")
    parser.add_argument("--replace", action="store_true", help="if there is one of that name")


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import context

    return context.add(options)
