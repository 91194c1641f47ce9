"""`callboard web`: the graph in a browser."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.web_address import DEFAULT_LISTEN
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

EXAMPLES: Final = {
    "callboard web": "the page, opened in the browser, until Ctrl-C",
    "callboard web --allow-control": "also calls, goals, parameters and transitions",
    "callboard web --listen 0.0.0.0:8080 --no-browser": "for other machines, which need the printed token",
    "callboard web --listen 0.0.0.0:8443 --tls-cert host.pem --tls-key host.key": "the same with HTTPS",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_server_options(parser, listen=DEFAULT_LISTEN, control="calls, goals, parameters and transitions")
    parser.add_flag("--foxglove", help="serve Foxglove, too, as `callboard foxglove` does")
    parser.add_flag("--rosbridge", help="serve clients of rosbridge, too, as `callboard rosbridge` does")
    add_origin_option(parser)
    parser.add_flag("--no-browser", help="open no browser")


def run(options: Options) -> int:
    """Serve the page until SIGINT or SIGTERM."""

    async def attend(server: WebServer) -> None:
        import asyncio
        import webbrowser

        from actors.cli.browser_address import browser_address
        from actors.cli.output import print_out

        address = printed_address(server, server.url_with_token, options.token)
        announce(server, f"callboard web listening on {address}")
        for tool, name in tools.items():
            print_out(f"{name}: {printed_address(server, server.tool_url(tool), options.token)}")
        with browser_address(server.url_with_token) as opened:
            if not options.no_browser:
                await asyncio.to_thread(webbrowser.open, opened)
            await asyncio.Event().wait()

    names = {"foxglove": "Foxglove", "rosbridge": "rosbridge"}
    tools = {tool: name for tool, name in names.items() if getattr(options, tool)}
    return serve(options, attend, tools=tuple(tools))
