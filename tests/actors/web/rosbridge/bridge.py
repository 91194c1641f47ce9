"""A server for clients of rosbridge on the test's loop, and clients that speak the protocol by hand."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

from aiohttp import WSMsgType

from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import Callable

    import aiohttp


class RosbridgeClient:
    """A client of rosbridge.

    Args:
        socket: Its WebSocket.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket

    async def send(self, op: str, **fields: Any) -> None:
        """Send an operation."""
        await self.socket.send_str(json.dumps({"op": op, **fields}))

    async def next(self) -> dict[str, Any]:
        """Return the next operation that the server sends, in JSON."""
        async with asyncio.timeout(DEADLINE_SEC):
            message = await self.socket.receive()
        assert message.type is WSMsgType.TEXT, message
        return strict_json(message.data)

    async def next_bytes(self) -> bytes:
        """Return the next frame, which is binary."""
        async with asyncio.timeout(DEADLINE_SEC):
            return await self.socket.receive_bytes()

    async def until(self, fits: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the next operation that fits."""
        while not fits(found := await self.next()):
            pass
        return found

    async def call(self, service: str, args: Any = None, **fields: Any) -> dict[str, Any]:
        """Call a service; return its response."""
        await self.send("call_service", id=f"call:{service}", service=service, args=args, **fields)
        return await self.until(lambda found: found.get("id") == f"call:{service}")

    async def values(self, service: str, args: Any = None) -> Any:
        """Return the values of a response of a service that succeeds."""
        response = await self.call(service, args)
        assert response["result"] is True, response
        return response["values"]

    async def settled(self) -> None:
        """Wait until the server has done everything that was sent before."""
        await self.values("/rosapi/get_ros_version")


class Bridge(Site):
    """A server for clients of rosbridge."""

    async def connect(self, path: str = "/", **options: Any) -> RosbridgeClient:
        """Return a new client."""
        client: Any = self.client
        return RosbridgeClient(
            await self._stack.enter_async_context(client.ws_connect(path, max_msg_size=0, **options))
        )


def strict_json(text: str) -> dict[str, Any]:
    """Return what a JSON text says; NaN and infinities, which JSON lacks, are errors."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    found: dict[str, Any] = json.loads(text, parse_constant=refuse)
    return found
