"""A browser's session when the browser or the server goes at the wrong moment."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any, cast

from aiohttp import WSMessage, WSMsgType

from actors.web.live.session import MAX_PANELS, LiveSession
from tests.actors.meeting import DEADLINE_SEC, until

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from aiohttp.web import WebSocketResponse


class Socket:
    """A WebSocket whose browser never reads."""

    def __init__(self) -> None:
        self.received: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    def __aiter__(self) -> Socket:
        """Return the messages of the page."""
        return self

    async def __anext__(self) -> WSMessage:
        """Return the next one."""
        return WSMessage(WSMsgType.TEXT, json.dumps(await self.received.get()), None)

    async def send_str(self, _: str) -> None:
        """Wait until the browser has read: forever."""
        await asyncio.Event().wait()


class Panel:
    """A panel that always has something new."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self.closed = False
        wake()

    def pop(self) -> Callable[[], dict[str, Any]]:
        """Return it."""
        return lambda: {"news": 1}

    def close(self) -> None:
        """Remember it."""
        self.closed = True


class Pages:
    """A session, and the panels that it has made."""

    def __init__(self) -> None:
        self.socket = Socket()
        self.panels: list[Panel] = []
        session = LiveSession(cast("WebSocketResponse", self.socket), self._make, self._run)
        self.running = asyncio.create_task(session.run())

    async def _run(self, work: Callable[[], str]) -> str:
        return work()

    def _make(self, _name: str, _parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        self.panels.append(Panel(wake))
        return self.panels[-1]


async def test_a_session_that_is_cancelled_again_and_again_closes_its_panels() -> None:
    """As it is if the connection breaks while it already ends."""
    before = asyncio.all_tasks()
    pages = Pages()
    pages.socket.received.put_nowait({"open": 1, "panel": "graph"})
    await until(lambda: pages.panels)
    while not pages.running.done():
        pages.running.cancel()
        await asyncio.sleep(0)
    assert pages.panels[0].closed
    assert asyncio.all_tasks() == before


async def test_a_page_that_never_reads_its_errors_is_disconnected() -> None:
    """They do not fill the memory."""
    pages = Pages()
    for number in range(3 * MAX_PANELS):
        pages.socket.received.put_nowait({"open": number, "panel": "graph"})
    async with asyncio.timeout(DEADLINE_SEC):
        await pages.running
    assert len(pages.panels) == MAX_PANELS
    assert all(panel.closed for panel in pages.panels)
