"""The page: requests of any bytes, with a token or without, never end in an error of the server.

Server, broker, node and client share one event loop: a request is handled while the loop turns, and what has
not been answered after `TURNS` is given up, as by a browser that closes its tab.
"""

from __future__ import annotations

import asyncio
import logging
from contextlib import AsyncExitStack, suppress
from typing import Any, Final

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.web.observer import Observer
from actors.web.options import WebOptions
from actors.web.server import ROUTES, WebServer
from broker import Broker, BrokerOptions
from tests.fuzz.source import Source

TURNS: Final = 60
TOKEN: Final = "secret-of-the-page"
NAMES: Final = ("chatter", "add", "talker", "ns/x", "%2Fchatter", "rosout", "", "%00", "%ff", "a" * 300)
METHODS: Final = ("GET", "POST", "PATCH", "DELETE", "HEAD", "OPTIONS", "PUT", "TRACE")
UPGRADE: Final = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
)
HEADERS: Final = (
    "Content-Encoding: gzip",
    "Transfer-Encoding: chunked",
    "Expect: 100-continue",
    "Origin: http://localhost",
    UPGRADE,
    "Connection: close",
    "Range: bytes=0-",
    "If-None-Match: *",
    "Accept-Encoding: gzip",
    "Content-Length: 7",
    "Sec-Fetch-Site: cross-site",
    "Last-Event-ID: 1",
)
PATHS: Final = (*dict.fromkeys(each.path for each in ROUTES), "/", "/js/main.js", "/..%2f", "//")


class _Errors(logging.Handler):
    """Collects what is logged as an error."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(logging.Formatter().format(record))


class _Page:
    """The server, in a loop that turns only while an input is checked."""

    def __init__(self) -> None:
        self.errors = _Errors()
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(lambda _, context: self.errors.texts.append(str(context)))
        self._stack = AsyncExitStack()
        self._requests = 0
        logging.getLogger().addHandler(self.errors)
        self._loop.run_until_complete(self._open())

    async def _open(self) -> None:
        enter = self._stack.enter_async_context
        broker = await enter(Broker(BrokerOptions(port=0)))
        node = await enter(actors.Node("talker", url=broker.url, use_global_arguments=False))
        node.create_publisher(String, "/chatter", 10)
        node.create_service(AddTwoInts, "/add", lambda request, response: response)
        node.declare_parameter("speed", 1.5)
        observer = await enter(Observer(broker.url, 0))
        options = WebOptions(port=0, token=TOKEN, allow_control=True)
        self._server = await enter(WebServer(observer, options))

    def ask(self, request: bytes) -> bytes:
        """Send bytes from an address that has sent none; return what comes back."""
        self._requests += 1
        return self._loop.run_until_complete(self._ask(request))

    async def _ask(self, request: bytes) -> bytes:
        high, low = divmod(self._requests % 60_000, 250)
        address = f"127.1.{high}.{low + 1}"
        reader, writer = await asyncio.open_connection(
            "127.0.0.1", self._server.port, local_addr=(address, 0)
        )
        writer.write(request)
        for _ in range(TURNS):
            if reader.at_eof():
                break
            await asyncio.sleep(0)
        writer.close()
        with suppress(ConnectionError):
            await writer.wait_closed()
        with suppress(ConnectionError):
            return await reader.read()
        return b""

    def close(self) -> None:
        """Stop everything."""
        self._loop.run_until_complete(self._stack.aclose())
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()
        logging.getLogger().removeHandler(self.errors)


_page: _Page | None = None


def check(data: bytes) -> None:
    """Send one request; the first byte selects whether all of its bytes are given."""
    global _page  # noqa: PLW0603 - a server for every input would be slow
    if _page is None:
        _page = _Page()
    request = data[1:] if data[:1] < b"\x40" else _request(Source(data[1:]))
    answer = _page.ask(request)
    assert not answer.startswith((b"HTTP/1.1 500", b"HTTP/1.0 500")), (request, answer)
    errors = _page.errors.texts
    if errors:
        text, errors[:] = "\n".join(errors), []
        raise AssertionError(f"{request!r}: {text}")


def close() -> None:
    """Stop the server."""
    global _page  # noqa: PLW0603
    if _page is not None:
        _page.close()
        _page = None


def _request(source: Source) -> bytes:
    """Return a request of the right form whose parts are any bytes."""
    method = METHODS[source.below(len(METHODS))]
    path = PATHS[source.below(len(PATHS))]
    for part in ("name", "goal"):
        path = path.replace(f"{{{part}}}", NAMES[source.below(len(NAMES))])
    head: list[Any] = []
    given = source.below(256)
    if given & 3:
        head.append("Host: localhost")
    if given & 12:
        head.append(f"Authorization: Bearer {TOKEN}")
    if given & 16:
        head.append(b"Cookie: callboard_token=" + _line(source.take(source.below(32))))
    if given & 32:
        head.append(HEADERS[source.below(len(HEADERS))])
    if given & 64:
        head.append(_line(source.take(source.below(64))))
    query = b"?" + _line(source.take(source.below(64))).replace(b" ", b"+") if given & 128 else b""
    body = source.take(source.below(256))
    head.append(f"Content-Length: {len(body)}")
    lines = [each if isinstance(each, bytes) else each.encode() for each in head]
    return (
        method.encode()
        + b" "
        + path.encode()
        + query
        + b" HTTP/1.1\r\n"
        + b"\r\n".join(lines)
        + b"\r\n\r\n"
        + body
    )


def _line(data: bytes) -> bytes:
    return data.replace(b"\r", b"").replace(b"\n", b"")
