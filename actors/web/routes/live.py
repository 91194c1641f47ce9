"""The page's WebSocket."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web.live.session import MAX_REQUEST_BYTES, LiveSession
from actors.web.options import MAX_LIVE
from actors.web.routes.state import state_of, workspace_of

if TYPE_CHECKING:
    from collections.abc import Generator

    from actors.web.routes.state import State

HEARTBEAT_SEC: Final = 20.0
"""A browser that does not answer a ping within half of it is gone."""


@contextmanager
def counted(state: State) -> Generator[None]:
    """Count a browser or stream.

    Raises:
        web.HTTPServiceUnavailable: There are `MAX_LIVE`.
    """
    if state.live >= MAX_LIVE:
        raise web.HTTPServiceUnavailable(text=f"{MAX_LIVE} browsers and streams are connected already")
    state.live += 1
    try:
        yield
    finally:
        state.live -= 1


async def live(request: web.Request) -> web.WebSocketResponse:
    """Serve a page until it is closed."""
    state = state_of(request)
    with counted(state):
        socket = web.WebSocketResponse(heartbeat=HEARTBEAT_SEC, max_msg_size=MAX_REQUEST_BYTES, compress=True)
        await socket.prepare(request)
        state.sockets.add(socket)
        try:
            await LiveSession(socket, workspace_of(request).panels.make).run()
        finally:
            state.sockets.discard(socket)
            await socket.close()
    return socket


ROUTES: Final = (web.get("/api/live", live),)
