"""The listening socket of the web server, and the limits of its connections from the moment of accepting."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, cast

from actors.web import limits
from actors.web.accepting import Acceptor, AddressQueues
from actors.web.connection import RECEIVE_BYTES, UNKNOWN, WebConnection
from actors.web.connection_table import ConnectionTable
from actors.web.refusals import Refusal, Refusals
from proto.aio.read_budget import ReadBudget
from proto.wire.addresses import owned_by_one, parse_address

if TYPE_CHECKING:
    from collections.abc import Callable
    from ssl import SSLContext

    from aiohttp import web

    from proto.aio.read_budget import Reader


class AddressBudget(ReadBudget):
    """A read budget that gives shares to each address in turn.

    A handshake takes most of a millisecond, and one address may begin a hundred at once.

    Args:
        loop: The event loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(loop)
        self._readers = AddressQueues["Reader"]()

    def wait(self, reader: Reader) -> None:
        """Call `reader.go_on_reading` in a later loop turn, when it is the turn of its address."""
        name = cast("asyncio.BaseTransport", reader).get_extra_info("peername")
        self._readers.add(owned_by_one(parse_address(name[0])) if name else UNKNOWN, reader)
        super().wait(self)

    def go_on_reading(self) -> None:
        """Called by itself, as often as readers wait: let one go on."""
        self._readers.pop().go_on_reading()


class WebListener:
    """Accepts connections, and closes some when there are too many.

    Attributes:
        refusals: Counts what limits end.
        buffer: For received bytes.
        port: The port; known once it listens.
    """

    def __init__(self) -> None:
        self._table = ConnectionTable[WebConnection]()
        self._by_protocol: dict[asyncio.BaseProtocol, WebConnection] = {}
        self._acceptor: Acceptor | None = None
        self.refusals = Refusals(self._table.__len__)
        self.buffer = memoryview(bytearray(RECEIVE_BYTES))
        self.port = 0

    async def listen(
        self, host: str, port: int, http: Callable[[], asyncio.Protocol], tls: SSLContext | None
    ) -> None:
        """Listen.

        Args:
            host: The address.
            port: The port; 0 for any that is free.
            http: Makes the protocol of HTTP for a connection.
            tls: The context for HTTPS; None for HTTP.

        Raises:
            OSError: It cannot.
            UnicodeError: The host is a name that cannot be one.
        """
        self._http = http
        loop = asyncio.get_running_loop()
        connect = partial(WebConnection, self, loop)
        protocol = connect if tls is None else _encrypted(connect, tls, loop)
        # For its sockets only: it would open connections in the order of their arrival.
        server = await loop.create_server(protocol, host, port, start_serving=False)
        sockets = [each.dup() for each in server.sockets]
        server.close()
        for each in sockets:
            each.listen(limits.BACKLOG)
        self.port = sockets[0].getsockname()[1]
        self._acceptor = Acceptor(protocol, partial(self.count, Refusal.ROOM))
        self._acceptor.start(sockets)

    async def stop_listening(self) -> None:
        """Accept no more connections."""
        if self._acceptor is not None:
            await self._acceptor.stop()

    def close(self) -> None:
        """End all connections."""
        for connection in self._table.connections():
            connection.abort()
        self.refusals.close()

    def connection_of(self, request: web.Request) -> WebConnection:
        """Return the connection of a request."""
        return self._by_protocol[request.protocol]

    def in_reserve(self, connection: WebConnection) -> bool:
        """Return whether only probes are answered on a connection."""
        return self._table.in_reserve(connection)

    def prove(self, connection: WebConnection, user: str | None) -> bool:
        """Note that a connection, which is at work, has shown a valid token.

        Args:
            connection: The connection.
            user: The broker's user; None for the server's own token.

        Returns:
            Whether there is room for another connection of the user.
        """
        victim = self._table.prove(connection, user)
        if victim is connection:
            self.count(Refusal.CONNECTIONS, user)
            return False
        connection.holder = user or connection.holder
        self._make_room(victim)
        return True

    # The owner of connections

    def opened(self, connection: WebConnection) -> None:
        """Owner: find room for a new connection."""
        self._make_room(self._table.enter(connection, connection.source))

    def begin_http(self, connection: WebConnection) -> asyncio.Protocol:
        """Owner: a connection has received something."""
        protocol = self._http()
        self._by_protocol[protocol] = connection
        return protocol

    def changed(self, connection: WebConnection) -> None:
        """Owner: a connection may wait for its client now, or not any more."""
        (self._table.wait if connection.waits else self._table.work)(connection)

    def unread(self, connection: WebConnection) -> None:
        """Owner: a client has not read everything; close one of those with most if it is too much."""
        if connection.unread_bytes <= limits.PIECE_BYTES:
            return
        of_all = [each for each in self._table.connections() if each.unread_bytes]
        of_holder = [each for each in of_all if each.holder == connection.holder]
        for some, most in (
            (of_holder, limits.MAX_HOLDER_UNREAD_BYTES),
            (of_all, limits.MAX_UNREAD_BYTES),
        ):
            if sum(each.unread_bytes for each in some) > most:
                largest = max(some, key=lambda each: each.unread_bytes)
                self.count(Refusal.UNREAD_BYTES, largest.holder)
                largest.abort()
                return

    def count(self, refusal: Refusal, source: object) -> None:
        """Owner: a connection is ended."""
        self.refusals.count(refusal, source)

    def closed(self, connection: WebConnection, http: asyncio.Protocol | None) -> None:
        """Owner: a connection has ended."""
        self._table.leave(connection)
        if http is not None:
            del self._by_protocol[http]

    def _make_room(self, victim: WebConnection | None) -> None:
        if victim is not None:
            self.count(Refusal.ROOM, victim.source)
            victim.abort()


def _encrypted(
    connect: Callable[[], WebConnection], context: SSLContext, loop: asyncio.AbstractEventLoop
) -> Callable[[], asyncio.BaseProtocol]:
    from proto.aio.tls_transport import TlsTransport  # noqa: PLC0415 - `ssl` takes milliseconds

    budget = AddressBudget(loop)
    return lambda: TlsTransport(connect(), context, loop=loop, budget=budget)
