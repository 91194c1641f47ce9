"""`callboard broker`: the daemon, as `python -m broker` runs it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.interrupts import raise_at_once
from broker import command

if TYPE_CHECKING:
    import argparse


EXAMPLES: Final = {
    "callboard broker": "listen on callboard://127.0.0.1:7411, until Ctrl-C",
    "callboard broker --host 0.0.0.0 --auth access.toml": "for other machines: for the users in that file",
    "callboard broker --http 127.0.0.1:7412": "with the page and metrics beside it",
    "callboard broker --config broker.toml": "with the options in a file",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags."""
    command.add_arguments(parser)
    parser.add_argument("--http", metavar="HOST:PORT", help="also serve the page, the API and metrics there")
    parser.add_argument(
        "--http-allow-control", action="store_true",
        help="allow the page calls, goals, parameters and transitions, with the token that is printed",
    )  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    beside = None
    if options.http is not None and not options.print_config and not options.healthcheck:
        from actors.cli.web_address import check_web
        from actors.cli.web_child import web_beside

        check_web(options.http, "--http")
        beside = partial(web_beside, listen=options.http, allow_control=options.http_allow_control)
    elif options.http_allow_control:
        raise CommandError("--http-allow-control needs --http")
    # The daemon would import these itself, when a signal already raises.
    import_module("broker.daemon")
    with suppress(ImportError):
        import_module("uvloop")
    raise_at_once()
    return command.run(options, beside)
