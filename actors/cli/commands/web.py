"""`callboard web`: the graph in a browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.errors import FAILURE, OK, CommandError
from actors.cli.output import print_err, print_out
from actors.cli.parsing import Options, Parser, add_broker_options
from actors.cli.web_address import DEFAULT_LISTEN, require_packages, split_listen

if TYPE_CHECKING:
    from actors.web.options import WebOptions
    from actors.web.server import WebServer

EXAMPLES: Final = {
    "callboard web": "the page, opened in the browser, until Ctrl-C",
    "callboard web --allow-control": "also calls, goals, parameters and transitions",
    "callboard web --listen 0.0.0.0:8080 --no-browser": "for other machines, which need the printed token",
    "callboard web --listen 0.0.0.0:8443 --tls-cert host.pem --tls-key host.key": "the same with HTTPS",
}

READING_NOTE: Final = (
    "Reading needs the token of this address, because the broker is not for everybody on this machine; "
    "--read-without-token lets everybody on this machine read"
)


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--listen", metavar="HOST:PORT", default=DEFAULT_LISTEN,
        help=f"the address to serve; port 0: any that is free; default: {DEFAULT_LISTEN}",
    )  # fmt: skip
    parser.add_flag("--allow-control", help="allow calls, goals, parameters and transitions, with the token")
    parser.add_argument(
        "--allow-host", action="append", default=[], metavar="NAME",
        help="a name by which browsers may call the server; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--token", metavar="FILE",
        help="a file with the token for control, and beyond loopback for reading; default: a random one",
    )  # fmt: skip
    parser.add_flag(
        "--users",
        help="let the users of the broker's --auth sign in with their tokens, each with their own rights",
    )
    parser.add_argument("--tls-cert", metavar="FILE", help="serve HTTPS with this certificate and its chain")
    parser.add_argument("--tls-key", metavar="FILE", help="the certificate's private key")
    parser.add_flag(
        "--read-without-token",
        help="let everybody on this machine read without the token, also if the broker asks for credentials",
    )
    parser.add_flag("--no-browser", help="open no browser")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Serve the page until SIGINT or SIGTERM."""
    from actors.cli.loop import run_async

    require_packages(FAILURE)
    from actors.web.worker import SWITCH_SEC

    sys.setswitchinterval(SWITCH_SEC)
    chosen = _web_options(options)
    run_async(lambda: _serve(options, chosen))
    return OK


def _web_options(options: Options) -> WebOptions:
    from actors.web.options import WebOptions
    from actors.web.token_file import read_token
    from proto.aio.tls import server_context

    host, port = split_listen(options.listen, "--listen")
    if (options.tls_cert is None) != (options.tls_key is None):
        raise CommandError("--tls-cert and --tls-key need each other")
    tls = None
    if options.tls_cert is not None:
        tls = server_context(Path(options.tls_cert), Path(options.tls_key), None)
    return WebOptions(
        host=host,
        port=port,
        allow_control=options.allow_control,
        token=None if options.token is None else read_token(options.token),
        users=options.users,
        allowed_hosts=tuple(options.allow_host),
        read_without_token=options.read_without_token,
        tls=tls,
    )


async def _serve(options: Options, chosen: WebOptions) -> None:
    import asyncio
    import webbrowser

    from actors.cli.broker_target import connected, target_of
    from actors.cli.browser_address import browser_address
    from actors.web.observer import Observer
    from actors.web.server import WebServer
    from proto.aio import process

    target = target_of(options)
    observer = Observer(target.url, target.domain)
    async with connected(observer, target), WebServer(observer, chosen) as server:
        # A garbage collection of what the imports have made holds the event loop for 30 ms.
        process.configure_process()
        print_out(f"callboard web listening on {_printed(server, options.token)}")
        if server.asks_for_token:
            print_err(READING_NOTE)
        with browser_address(server.url_with_token) as address:
            if not options.no_browser:
                await asyncio.to_thread(webbrowser.open, address)
            await asyncio.Event().wait()


def _printed(server: WebServer, token_file: str | None) -> str:
    """Return the page's address as it is printed: without its token where that would be kept for others."""
    from actors.config.environment import is_journal

    if "#" not in server.url_with_token or not is_journal(1):
        return server.url_with_token
    if token_file is None:
        return f"{server.url} (its token is not written to the journal: give it one with --token FILE)"
    return f"{server.url} (its token is in {token_file})"
