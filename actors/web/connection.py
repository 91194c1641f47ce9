"""One connection of the web server, between its transport and the protocol of HTTP."""

from __future__ import annotations

import asyncio
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol, cast

from actors.web import limits
from actors.web.refusals import Refusal
from proto.aio.tls import is_tls_error
from proto.wire.addresses import Address, owned_by_one, parse_address

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.web.connection_table import Holder

UNKNOWN: Final = parse_address("0.0.0.0")  # noqa: S104 - nobody has it
"""The address of a connection that is gone already."""

RECEIVE_BYTES: Final = 64 * 1024
"""The size of the buffer for what is received, which all connections share."""


class Owner(Protocol):
    """The listener of a connection."""

    buffer: memoryview
    """For what is received: all connections share it, as it is used up at once."""

    def opened(self, connection: WebConnection) -> None:
        """The connection is open."""
        ...

    def begin_http(self, connection: WebConnection) -> asyncio.Protocol:
        """Return the protocol of HTTP: the connection has received something."""
        ...

    def changed(self, connection: WebConnection) -> None:
        """`connection.waits` may have changed."""
        ...

    def unread(self, connection: WebConnection) -> None:
        """The client has not read everything."""
        ...

    def count(self, refusal: Refusal, source: object) -> None:
        """The connection is ended because of a limit."""
        ...

    def closed(self, connection: WebConnection, http: asyncio.Protocol | None) -> None:
        """The connection has ended."""
        ...


class WebConnection(asyncio.BufferedProtocol):
    """A connection, from the moment that it is accepted.

    The protocol of HTTP, which costs much more, begins with the first byte; with HTTPS after the handshake.

    Args:
        owner: Its listener.
        loop: The event loop.

    Attributes:
        address: The address that it comes from.
        source: The same; the network for IPv6.
        holder: Whose connection it is: a user of the broker, or the address.
    """

    def __init__(self, owner: Owner, loop: asyncio.AbstractEventLoop) -> None:
        self.address: Address = UNKNOWN
        self.source: Address = UNKNOWN
        self.holder: Holder = UNKNOWN
        self._owner, self._loop = owner, loop
        self._transport: asyncio.Transport | None = None
        self._http: asyncio.Protocol | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._handled = self._stalled = self._unread = False

    @property
    def waits(self) -> bool:
        """Whether the server waits for the client."""
        return self._stalled or self._unread or not self._handled

    @contextmanager
    def handling(self) -> Generator[None]:
        """Handle a request: the server does something for the client."""
        self._handled = True
        self._owner.changed(self)
        try:
            yield
        finally:
            self._handled = False
            self._owner.changed(self)

    @contextmanager
    def waiting(self) -> Generator[None]:
        """Wait, while a request is handled, for what its client sends, or for the answer to its token."""
        self._stalled = True
        self._owner.changed(self)
        try:
            yield
        finally:
            self._stalled = False
            self._owner.changed(self)

    @property
    def unread_bytes(self) -> int:
        """Bytes that wait until the client reads."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def stop_reading(self) -> None:
        """Receive nothing more."""
        if self._transport is not None:
            self._transport.pause_reading()

    def abort(self) -> None:
        """End it at once."""
        if self._transport is not None:
            self._transport.abort()

    # The protocol of the transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._transport = cast("asyncio.Transport", transport)
        # Any byte that the client does not read pauses writing, so that `UNREAD_SEC` holds for all of them.
        self._transport.set_write_buffer_limits(high=0)
        name = transport.get_extra_info("peername")
        if name:
            self.address = parse_address(name[0])
            self.source = self.holder = owned_by_one(self.address)
        self._call_after(limits.FIRST_BYTE_SEC, partial(self._end, Refusal.SILENT))
        self._owner.opened(self)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio."""
        return self._owner.buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio."""
        if self._http is None:
            assert self._transport is not None
            self._stop_timer()
            self._http = self._owner.begin_http(self)
            self._http.connection_made(self._transport)
        self._http.data_received(bytes(self._owner.buffer[:nbytes]))

    def eof_received(self) -> bool:
        """Called by asyncio."""
        if self._transport is not None:  # a TLS transport does not do it by itself
            self._transport.close()
        return False

    def pause_writing(self) -> None:
        """Called by asyncio."""
        if self._http is not None:  # before it, the time for the first byte goes on
            self._unread = True
            self._expect_reading()
            self._owner.changed(self)
            self._http.pause_writing()
            self._owner.unread(self)

    def resume_writing(self) -> None:
        """Called by asyncio."""
        if self._http is not None and self._unread:
            self._unread = False
            self._stop_timer()
            self._owner.changed(self)
            self._http.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._stop_timer()
        self._transport = None
        if self._http is None and is_tls_error(exc):
            self._owner.count(Refusal.TLS, self.source)
        http, self._http = self._http, None
        self._owner.closed(self, http)
        if http is not None:
            http.connection_lost(exc)

    def _expect_reading(self) -> None:
        """End it unless the client reads some of what waits: all of it may take long on a slow link."""
        unread = self.unread_bytes

        def check() -> None:
            if self.unread_bytes < unread:
                self._expect_reading()
            else:
                self._end(Refusal.UNREAD)

        self._call_after(limits.UNREAD_SEC, check)

    def _end(self, refusal: Refusal) -> None:
        self._owner.count(refusal, self.source)
        self.abort()

    def _call_after(self, seconds: float, function: Callable[[], object]) -> None:
        self._stop_timer()
        self._timer = self._loop.call_later(seconds, function)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
