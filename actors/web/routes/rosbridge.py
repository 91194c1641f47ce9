"""The WebSocket of clients of rosbridge: see `actors.web.rosbridge`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.web import limits
from actors.web.refusals import Refusal
from actors.web.rosbridge.session import MAX_FRAME_BYTES, RosbridgeSession
from actors.web.routes.live_tool import HEARTBEAT_SEC, LiveTool
from actors.web.routes.state import CONNECTION, control_refusal, state_of, workspace_of
from actors.web.routes.web_socket import open_web_socket

if TYPE_CHECKING:
    from aiohttp import web


async def rosbridge(request: web.Request) -> web.WebSocketResponse:
    """Serve a client until it leaves."""
    listener, connection = state_of(request).listener, request[CONNECTION]

    def disconnect() -> None:
        listener.count(Refusal.UNREAD_BYTES, connection.holder)
        connection.abort()

    refusal = control_refusal(request)
    most = limits.MAX_READ_ONLY_MESSAGE_BYTES if refusal else MAX_FRAME_BYTES
    async with open_web_socket(request, most=most, heartbeat_sec=HEARTBEAT_SEC) as socket:
        session = RosbridgeSession(
            socket,
            workspace_of(request),
            control_refusal=refusal,
            disconnect=disconnect,
            count_drops=listener.refusals.count_drops,
        )
        await session.run()
    return socket


TOOL: Final = LiveTool(name="rosbridge", handler=rosbridge, open_control=True)
