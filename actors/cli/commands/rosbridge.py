"""`callboard rosbridge`: the graph for roslib, roslibpy and other clients of rosbridge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.web_server import (
    add_origin_option,
    add_server_options,
    announce,
    printed_address,
    serve,
)

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser
    from actors.web.server import WebServer

DEFAULT_LISTEN: Final = "127.0.0.1:9090"

EXAMPLES: Final = {
    "callboard rosbridge": "topics and the graph for roslib and roslibpy, until Ctrl-C",
    "callboard rosbridge --allow-control": "clients may also publish, call, serve, and set parameters",
    "callboard rosbridge --allow-origin http://localhost:8000": "for pages of that site, too",
    "callboard rosbridge --listen 0.0.0.0:9090": "for other machines, which need the printed token",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    control = "publishing, calls, goals and setting parameters"
    add_server_options(parser, listen=DEFAULT_LISTEN, control=control, hosts="clients")
    add_origin_option(parser)


def run(options: Options) -> int:
    """Serve clients until SIGINT or SIGTERM."""

    async def attend(server: WebServer) -> None:
        import asyncio

        printed = printed_address(server, server.tool_url("rosbridge"), options.token)
        announce(server, f"callboard rosbridge listening on {printed}")
        await asyncio.Event().wait()

    return serve(options, attend, page=False, tools=("rosbridge",))
