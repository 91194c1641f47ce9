"""One browser's connection: the panels that its page has opened, and what they send.

The page sends JSON objects: `{"open": ID, "panel": NAME, ...parameters}` and `{"close": ID}`. It gets
`{"id": ID, ...}` with what `Panel.pop` of that panel returned, and `{"id": ID, "error": TEXT}` if it
cannot be opened or has failed.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import msgspec
from aiohttp import WSMsgType

from actors.web.json_decoding import decode_json
from actors.web.json_encoding import encode_json
from actors.web.live.panel import PanelError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from aiohttp.web import WebSocketResponse

    from actors.web.live.panel import Body, Panel

UPDATE_PERIOD_SEC: Final = 0.05
"""Seconds between two updates of a browser or a stream: twenty a second look continuous."""

MAX_PANELS: Final = 32
"""Panels that a page may have open at the same time."""

MAX_REQUEST_BYTES: Final = 64 * 1024
"""Largest message from the page."""


class LiveSession:
    """A browser's session.

    Args:
        socket: The prepared WebSocket.
        make_panel: Returns the panel of a name, its parameters and the function that wakes the session.
        run: Calls a function in a thread, and returns what it returns.
    """

    def __init__(
        self,
        socket: WebSocketResponse,
        make_panel: Callable[[str, Mapping[str, Any], Callable[[], None]], Panel],
        run: Callable[[Callable[[], str]], Awaitable[str]],
    ) -> None:
        self._socket, self._run = socket, run
        self._make_panel = make_panel
        self._panels: dict[int, Panel] = {}
        self._dirty: dict[int, None] = {}
        """Panels with something new, in the order in which they woke the session."""
        self._errors: dict[int, str] = {}
        self._news = asyncio.Event()

    async def run(self) -> None:
        """Serve the browser until it leaves."""
        try:
            async with asyncio.TaskGroup() as group:
                sending = group.create_task(self._send_regularly())
                await self._receive()
                sending.cancel()
        except* ConnectionError:
            pass  # the browser has gone
        finally:
            for panel in self._panels.values():
                panel.close()

    async def _receive(self) -> None:
        async for message in self._socket:
            if message.type is not WSMsgType.TEXT:
                break
            self._handle(message.data)
            if len(self._errors) > MAX_PANELS:
                break  # it does not read them

    def _handle(self, text: str) -> None:
        try:
            request = decode_json(text, dict[str, Any])
        except msgspec.DecodeError as error:
            self._fail(0, f"Not a JSON object: {error}")
            return
        if "close" in request:
            self._close(request["close"])
            return
        number = request.pop("open", None)
        if type(number) is not int or number in self._panels:
            self._fail(0, "Give a panel to open a number of its own")
        elif len(self._panels) >= MAX_PANELS:
            self._fail(number, f"{MAX_PANELS} panels are open already; close one")
        else:
            try:
                name = str(request.pop("panel", ""))
                self._panels[number] = self._make_panel(name, request, lambda: self._wake(number))
            except (PanelError, CallboardError, msgspec.ValidationError) as error:
                self._fail(number, str(error))

    def _close(self, number: object) -> None:
        if isinstance(number, int) and number in self._panels:
            self._panels.pop(number).close()
            self._dirty.pop(number, None)

    def _wake(self, number: int) -> None:
        self._dirty[number] = None
        self._news.set()

    def _fail(self, number: int, text: str) -> None:
        self._errors[number] = text
        self._news.set()

    async def _send_regularly(self) -> None:
        """Send what is new, and wait while the browser is slow: what changes meanwhile is combined."""
        while True:
            await self._news.wait()
            self._news.clear()
            errors, self._errors = self._errors, {}
            dirty, self._dirty = self._dirty, {}
            for number, text in errors.items():
                await self._socket.send_str(_encoded_error(number, text))
            for number in dirty:
                if text := await self._news_of(number):
                    await self._socket.send_str(text)
            await asyncio.sleep(UPDATE_PERIOD_SEC)

    async def _news_of(self, number: int) -> str:
        """Return the next message of a panel; empty if it has none."""
        panel = self._panels.get(number)
        if panel is None:
            return ""
        try:
            body = panel.pop()
            return "" if body is None else await self._run(partial(_encoded, number, body))
        except CallboardError as error:  # such as a graph too large to be drawn
            self._close(number)
            return _encoded_error(number, str(error))


def _encoded(number: int, body: Body) -> str:
    found = body()
    return "" if found is None else encode_json({"id": number, **found}).decode()


def _encoded_error(number: int, text: str) -> str:
    return msgspec.json.encode({"id": number, "error": text}).decode()
