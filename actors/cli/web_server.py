"""What the verbs share that start a web server: its options, and serving until they are interrupted."""

from __future__ import annotations

import sys
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import FAILURE, OK, CommandError
from actors.cli.output import print_err, print_out
from actors.cli.parsing import Options, Parser, add_broker_options
from actors.cli.web_address import require_packages, split_listen

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Awaitable, Callable

    from actors.web.options import WebOptions
    from actors.web.server import WebServer

READING_NOTE: Final = (
    "Reading needs the token of this address, because the broker is not for everybody on this machine; "
    "--read-without-token lets everybody on this machine read"
)


def add_server_options(parser: Parser, *, listen: str, control: str, hosts: str = "browsers") -> None:
    """Describe the options of a web server, and those of the broker that it is a client of.

    Args:
        parser: Gets them.
        listen: The default address, as HOST:PORT.
        control: What `--allow-control` allows.
        hosts: Who calls the server by a name.
    """
    parser.add_argument(
        "--listen", metavar="HOST:PORT", default=listen,
        help=f"the address to serve; port 0: any that is free; default: {listen}",
    )  # fmt: skip
    parser.add_flag("--allow-control", help=f"allow {control}, with the token")
    parser.add_argument(
        "--allow-host", action="append", default=[], metavar="NAME",
        help=f"a name by which {hosts} may call the server; may be repeated",
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
    add_broker_options(parser)


def add_origin_option(parser: Parser) -> None:
    """Describe the option for the sites whose pages may speak the protocols of live tools."""
    parser.add_argument(
        "--allow-origin", action="append", default=[], metavar="ORIGIN",
        help="a site whose pages may connect, such as https://tools.example; may be repeated",
    )  # fmt: skip


def serve(options: Options, attend: Callable[[WebServer], Awaitable[None]], **more: Any) -> int:
    """Run a web server until SIGINT or SIGTERM.

    Args:
        options: With those of `add_server_options`.
        attend: Says where the server is, and waits; when it returns, the server stops.
        **more: Further fields of WebOptions.

    Returns:
        The exit code.

    Raises:
        CommandError: An option is wrong, a package is missing, or no broker answers.
    """
    from actors.cli.loop import run_async  # noqa: PLC0415 - reading arguments loads nothing else

    require_packages(FAILURE)
    from actors.web.worker import SWITCH_SEC  # noqa: PLC0415

    sys.setswitchinterval(SWITCH_SEC)
    chosen = _web_options(options, **more)

    async def run() -> None:
        async with _server(options, chosen) as server:
            await attend(server)

    run_async(run)
    return OK


def announce(server: WebServer, line: str) -> None:
    """Print where a server is, and why reading needs a token if that is not obvious.

    Args:
        server: The server, which listens.
        line: The text.
    """
    print_out(line)
    if server.asks_for_token:
        print_err(READING_NOTE)


def printed_address(server: WebServer, address: str, token_file: str | None) -> str:
    """Return an address as it is printed: without its token where that would be kept for others.

    Args:
        server: Has the token.
        address: With the token if it grants anything.
        token_file: The file that the token is from; None if it is a random one.
    """
    from actors.config.environment import is_journal  # noqa: PLC0415

    if server.token not in address or not is_journal(1):
        return address
    without = address.partition("#")[0].partition("?")[0]
    if token_file is None:
        return f"{without} (its token is not written to the journal: give it one with --token FILE)"
    return f"{without} (its token is in {token_file})"


def _web_options(options: Options, **more: Any) -> WebOptions:
    from actors.web.options import WebOptions  # noqa: PLC0415
    from actors.web.token_file import read_token  # noqa: PLC0415
    from proto.aio.tls import server_context  # noqa: PLC0415

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
        allowed_origins=tuple(options.allow_origin),
        read_without_token=options.read_without_token,
        tls=tls,
        **more,
    )


@asynccontextmanager
async def _server(options: Options, chosen: WebOptions) -> AsyncGenerator[WebServer]:
    from actors.cli.broker_target import connected, target_of  # noqa: PLC0415
    from actors.web.observer import Observer  # noqa: PLC0415
    from actors.web.server import WebServer  # noqa: PLC0415
    from proto.aio import process  # noqa: PLC0415

    target = target_of(options)
    observer = Observer(target.url, target.domain)
    async with connected(observer, target), WebServer(observer, chosen) as server:
        # A garbage collection of what the imports have made holds the event loop for 30 ms.
        process.configure_process()
        yield server
