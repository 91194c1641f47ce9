"""The page's WebSocket."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.web.live.session import MAX_REQUEST_BYTES, LiveSession
from actors.web.routes.route import Route
from actors.web.routes.state import workspace_of
from actors.web.routes.web_socket import open_web_socket

if TYPE_CHECKING:
    from aiohttp import web


async def live(request: web.Request) -> web.WebSocketResponse:
    """Serve a page until it is closed."""
    async with open_web_socket(request, most=MAX_REQUEST_BYTES, compress=True) as socket:
        workspace = workspace_of(request)
        await LiveSession(socket, workspace.panels.make, workspace.work.run).run()
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
