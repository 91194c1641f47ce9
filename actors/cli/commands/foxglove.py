"""`callboard foxglove`: the graph in Foxglove."""

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

DEFAULT_LISTEN: Final = "127.0.0.1:8765"

EXAMPLES: Final = {
    "callboard foxglove": "topics, parameters and the graph for Foxglove, until Ctrl-C",
    "callboard foxglove --allow-control": "Foxglove may also publish, call services and set parameters",
    "callboard foxglove --listen 0.0.0.0:8765": "for other machines, which need the printed token",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_server_options(
        parser, listen=DEFAULT_LISTEN, control="publishing, calls and setting parameters", hosts="clients"
    )
    add_origin_option(parser)


def run(options: Options) -> int:
    """Serve Foxglove until SIGINT or SIGTERM."""

    async def attend(server: WebServer) -> None:
        import asyncio

        from actors.cli.foxglove_link import foxglove_link
        from actors.cli.output import print_out

        address = server.tool_url("foxglove")
        printed = printed_address(server, address, options.token)
        announce(server, f"callboard foxglove listening on {printed}")
        if printed == address:
            print_out(f"Open it in Foxglove: {foxglove_link(address)}")
        await asyncio.Event().wait()

    return serve(options, attend, page=False, tools=("foxglove",))
