"""`callboard broker`: the daemon, as `python -m broker` runs it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Final

from actors.cli.interrupts import raise_at_once
from broker.daemon import command

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager

    from broker import Broker
    from broker.options import DaemonOptions


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


def run(options: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    # The daemon would import these itself, when a signal already raises.
    import_module("broker.daemon.daemon")
    with suppress(ImportError):
        import_module("uvloop")
    raise_at_once()
    return command.run(options, _prepare_page)


def _prepare_page(options: DaemonOptions) -> Callable[[Broker], AbstractAsyncContextManager[None]]:
    """Check that the page can be served; return what starts its process beside the broker.

    Raises:
        CommandError: A package is missing, or the address cannot be used; the exit code is 2.
    """
    from actors.cli.web_address import check_web

    assert options.http is not None
    check_web(options.http, "--http")
    return partial(_page_beside, options, options.http)


def _page_beside(options: DaemonOptions, listen: str, broker: Broker) -> AbstractAsyncContextManager[None]:
    """Return the page's process, with the users and the certificate of the broker."""
    from actors.cli.web_child import web_beside
    from actors.config.environment import tls_files

    further = {
        "--token": options.http_token,
        "--tls-cert": broker.options.tls_cert,
        "--tls-key": broker.options.tls_key,
    }
    arguments = [word for flag, value in further.items() if value for word in (flag, str(value))]
    arguments += ["--allow-control"] * options.http_allow_control
    arguments += ["--read-without-token"] * options.http_read_without_token
    arguments += ["--users"] * (broker.options.auth is not None)
    own = str(broker.options.tls_cert or "")
    # Behind another URL there may be a proxy with its own certificate: then the environment knows better.
    ca = "" if options.http_url and tls_files().ca else own
    return web_beside(options.http_url or broker.url, listen, *arguments, ca=ca)
