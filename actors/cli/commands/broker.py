"""`callboard broker`: the daemon, as `python -m broker` runs it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.interrupts import raise_at_once
from broker.daemon import command

if TYPE_CHECKING:
    import argparse
    from contextlib import AbstractAsyncContextManager

    from broker import Broker


EXAMPLES: Final = {
    "callboard broker": "listen on callboard://127.0.0.1:7411, until Ctrl-C",
    "callboard broker --host 0.0.0.0 --auth access.toml": "for other machines: for the users in that file",
    "callboard broker --http 127.0.0.1:7412": "with the page and metrics beside it",
    "callboard broker --http 0.0.0.0:7412 --auth access.toml": "where its users sign in with their tokens",
    "callboard broker --config broker.toml": "with the options in a file",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags."""
    command.add_arguments(parser)
    parser.add_argument(
        "--http", metavar="HOST:PORT",
        help="also serve the page, the API and metrics there; with --auth its users sign in there, and with"
        " --tls-cert it is HTTPS",
    )  # fmt: skip
    parser.add_argument(
        "--http-url", metavar="URL",
        help="the broker's URL for the page's process, such as callboards://robot.local:7411, if the broker's"
        " certificate is not for the address that it listens on",
    )  # fmt: skip
    parser.add_argument(
        "--http-token", metavar="FILE",
        help="a file with the page's token, such as for Prometheus; default: a random one, which is printed",
    )  # fmt: skip
    parser.add_argument(
        "--http-allow-control", action="store_true",
        help="allow the page calls, goals, parameters and transitions, with the token that is printed",
    )  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    beside = None
    needing = ("http_url", "http_token", "http_allow_control")
    if options.http is None and (wrong := [flag for flag in needing if getattr(options, flag)]):
        raise CommandError(f"--{wrong[0].replace('_', '-')} needs --http")
    if options.http is not None and not options.print_config and not options.healthcheck:
        from actors.cli.web_address import check_web

        check_web(options.http, "--http")
        beside = partial(_web_beside, options)
    # The daemon would import these itself, when a signal already raises.
    import_module("broker.daemon.daemon")
    with suppress(ImportError):
        import_module("uvloop")
    raise_at_once()
    return command.run(options, beside)


def _web_beside(options: argparse.Namespace, broker: Broker) -> AbstractAsyncContextManager[None]:
    """Return the page's process, with the users and the certificate of the broker."""
    from actors.cli.web_child import web_beside

    further = {
        "--token": options.http_token,
        "--tls-cert": broker.options.tls_cert,
        "--tls-key": broker.options.tls_key,
    }
    arguments = [word for flag, value in further.items() if value for word in (flag, str(value))]
    arguments += ["--allow-control"] * options.http_allow_control
    arguments += ["--users"] * (broker.options.auth is not None)
    return web_beside(options.http_url or broker.url, options.http, *arguments)
