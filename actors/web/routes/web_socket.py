"""Opens the WebSocket of a request, and closes it in the end."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web.routes.state import state_of

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

HEARTBEAT_SEC: Final = 20.0
"""A client that does not answer a ping within half of it is gone."""

HANDSHAKE_HEADERS: Final = (
    "Upgrade",
    "Connection",
    *(f"Sec-WebSocket-{part}" for part in ("Version", "Key", "Protocol", "Extensions")),
)


@asynccontextmanager
async def open_web_socket(
    request: web.Request,
    *,
    most: int,
    compress: bool = False,
    subprotocol: str = "",
    heartbeat_sec: float = HEARTBEAT_SEC,
) -> AsyncGenerator[web.WebSocketResponse]:
    """Open the WebSocket of a request; close it at the end of the context, or when the server stops.

    Args:
        request: The request.
        most: Bytes of a message from the client.
        compress: Whether messages are compressed if the client can.
        subprotocol: What is spoken; the client has offered it.
        heartbeat_sec: Seconds without anything from the client until it is pinged; it has half as many to
            answer, also if what waits for it on a slow link comes first.

    Raises:
        web.HTTPBadRequest: It is no handshake.
        ShareUsedUpError: As many are open as there may be.
    """
    for name in HANDSHAKE_HEADERS:
        if not request.headers.get(name, "").isascii():  # aiohttp raises UnicodeError, or ValueError
            raise web.HTTPBadRequest(text=f"The header {name} is not ASCII")
    state = state_of(request)
    with state.live_connection(request):
        socket = web.WebSocketResponse(
            heartbeat=heartbeat_sec,
            max_msg_size=most + 1,  # aiohttp refuses a message of exactly this size
            compress=compress,
            protocols=(subprotocol,) if subprotocol else (),
        )
        await socket.prepare(request)
        state.sockets.add(socket)
        try:
            yield socket
        finally:
            state.sockets.discard(socket)
            await socket.close()
