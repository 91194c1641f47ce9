"""Foxglove's WebSocket: see `actors.web.foxglove`."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web import limits
from actors.web.foxglove.client import FoxgloveClient
from actors.web.foxglove.messages import SUBPROTOCOLS
from actors.web.routes.live_tool import HEARTBEAT_SEC, LiveTool
from actors.web.routes.state import control_refusal, state_of, workspace_of
from actors.web.routes.web_socket import open_web_socket

ORIGINS: Final = frozenset({"https://app.foxglove.dev", "https://studio.foxglove.dev", "file://"})
"""Foxglove in the browser; desktop applications such as Lichtblick."""

WRONG_PROTOCOL: Final = (
    "This is a WebSocket for Foxglove and its relatives. A client offers one of the subprotocols "
    f"{' and '.join(SUBPROTOCOLS)}"
)


async def foxglove(request: web.Request) -> web.StreamResponse:
    """Serve a client until it leaves."""
    offered = request.headers.get("Sec-WebSocket-Protocol", "")
    names = {each.strip() for each in offered.split(",")}
    chosen = next((each for each in SUBPROTOCOLS if each in names), None)
    if chosen is None:
        raise web.HTTPBadRequest(text=WRONG_PROTOCOL)
    state = state_of(request)
    refusal = control_refusal(request)
    most = limits.MAX_READ_ONLY_MESSAGE_BYTES if refusal else limits.MAX_MESSAGE_BYTES
    async with open_web_socket(request, most=most, subprotocol=chosen, heartbeat_sec=HEARTBEAT_SEC) as socket:
        client = FoxgloveClient(
            socket,
            workspace_of(request),
            session_id=state.session_id,
            control_refusal=refusal,
            count_drops=state.listener.refusals.count_drops,
        )
        await client.run()
    return socket


TOOL: Final = LiveTool(name="foxglove", handler=foxglove, origins=ORIGINS)
