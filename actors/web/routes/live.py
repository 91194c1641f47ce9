"""The page's WebSocket."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web.live.session import MAX_REQUEST_BYTES, LiveSession
from actors.web.routes.route import Route
from actors.web.routes.state import state_of, workspace_of

HEARTBEAT_SEC: Final = 20.0
"""A browser that does not answer a ping within half of it is gone."""

HANDSHAKE_HEADERS: Final = (
    "Upgrade",
    "Connection",
    *(f"Sec-WebSocket-{part}" for part in ("Version", "Key", "Protocol", "Extensions")),
)


async def live(request: web.Request) -> web.WebSocketResponse:
    """Serve a page until it is closed."""
    for name in HANDSHAKE_HEADERS:
        if not request.headers.get(name, "").isascii():  # aiohttp raises UnicodeError, or ValueError
            raise web.HTTPBadRequest(text=f"The header {name} is not ASCII")
    state = state_of(request)
    with state.live_connection(request):
        socket = web.WebSocketResponse(heartbeat=HEARTBEAT_SEC, max_msg_size=MAX_REQUEST_BYTES, compress=True)
        await socket.prepare(request)
        state.sockets.add(socket)
        try:
            workspace = workspace_of(request)
            await LiveSession(socket, workspace.panels.make, workspace.work.run).run()
        finally:
            state.sockets.discard(socket)
            await socket.close()
    return socket


ROUTES: Final = (
    Route(
        "GET",
        "/api/live",
        live,
        summary="The WebSocket of the page; its messages may change",
        status=101,
    ),
)
