"""A web server on the test's loop, and requests to it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Self

import aiohttp

from actors.web.observer import Observer
from actors.web.options import WebOptions
from actors.web.server import WebServer
from tests.actors.meeting import DEADLINE_SEC

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AsyncExitStack

    from tests.actors.meeting import Meeting


class Site:
    """A web server for the meeting's broker.

    Args:
        stack: Ends it with the test.
        meeting: Has the broker.
        options: The server's; a free port and loopback by default.
    """

    def __init__(self, stack: AsyncExitStack, meeting: Meeting, options: WebOptions | None = None) -> None:
        self._stack = stack
        self.observer = Observer(meeting.url, 0)
        self.server = WebServer(self.observer, options or WebOptions(port=0))

    async def open(self) -> Self:
        """Start it, and a client."""
        await self._stack.enter_async_context(self.observer)
        await self._stack.enter_async_context(self.server)
        self.client = await self._stack.enter_async_context(aiohttp.ClientSession(self.url))
        return self

    @property
    def url(self) -> str:
        """The address."""
        return self.server.url

    async def first_line(self, sent: bytes) -> bytes:
        """Send bytes as they are; return the first line of the answer, empty if there is none."""
        async with asyncio.timeout(DEADLINE_SEC):
            reader, writer = await asyncio.open_connection("127.0.0.1", self.server.port)
            writer.write(sent)
            line = await reader.readline()
            writer.close()
            return line

    async def json(self, path: str, status: int = 200, method: str = "GET", **options: Any) -> Any:
        """Return the document of an answer with this status."""
        async with self.client.request(method, path, **options) as response:
            assert response.status == status, await response.text()
            return await response.json()

    async def json_until(self, path: str, fits: Callable[[Any], object]) -> Any:
        """Ask until the document fits: the graph takes a moment to be known."""
        async with asyncio.timeout(DEADLINE_SEC):
            while not fits(found := await self.json(path)):
                pass
            return found

    async def json_found(self, path: str) -> Any:
        """Return a document as soon as the graph has what it is about."""
        async with asyncio.timeout(DEADLINE_SEC):
            while True:
                async with self.client.get(path) as response:
                    if response.status == 200:
                        return await response.json()


class Page:
    """What a page gets over its WebSocket.

    Args:
        socket: The WebSocket.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket

    async def open(self, number: int, panel: str, **parameters: Any) -> None:
        """Open a panel."""
        await self.socket.send_json({"open": number, "panel": panel, **parameters})

    async def next(self) -> dict[str, Any]:
        """Return the next message."""
        async with asyncio.timeout(DEADLINE_SEC):
            found: dict[str, Any] = await self.socket.receive_json()
            return found

    async def until(self, fits: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the next message that fits."""
        while not fits(found := await self.next()):
            pass
        return found
