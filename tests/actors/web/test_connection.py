"""One connection of the web server, with a transport and a clock of the test."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, cast

from actors.web import limits
from actors.web.connection import WebConnection
from actors.web.refusals import Refusal

if TYPE_CHECKING:
    from collections.abc import Callable


class Clock:
    """An event loop that has timers only."""

    def __init__(self) -> None:
        self.timers: list[tuple[float, Callable[[], object]]] = []

    def call_later(self, seconds: float, function: Callable[[], object]) -> Clock:
        """Keep it."""
        self.timers.append((seconds, function))
        return self

    def cancel(self) -> None:
        """Cancel the only timer."""
        self.timers.clear()


class Transport(asyncio.Transport):
    """A transport whose client reads as the test says."""

    unread = 0
    aborted = False

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        """Return an address."""
        return ("192.0.2.1", 5000) if name == "peername" else default

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Do nothing."""

    def get_write_buffer_size(self) -> int:
        """Return what the test has set."""
        return self.unread

    def abort(self) -> None:
        """Note it."""
        self.aborted = True


class Owner:
    """A listener that notes why connections end."""

    def __init__(self) -> None:
        self.buffer = memoryview(bytearray(100))
        self.refusals: list[Refusal] = []

    def opened(self, connection: WebConnection) -> None:
        """Do nothing."""

    def begin_http(self, connection: WebConnection) -> asyncio.Protocol:
        """Return a protocol that ignores everything."""
        return asyncio.Protocol()

    def changed(self, connection: WebConnection) -> None:
        """Do nothing."""

    def unread(self, connection: WebConnection) -> None:
        """Do nothing."""

    def count(self, refusal: Refusal, source: object) -> None:
        """Note it."""
        self.refusals.append(refusal)

    def closed(self, connection: WebConnection, http: asyncio.Protocol | None) -> None:
        """Do nothing."""


def test_a_client_that_reads_slowly_goes_on() -> None:
    """Case 76: as long as it reads something; an image on a slow link takes minutes."""
    owner, clock, transport = Owner(), Clock(), Transport()
    connection = WebConnection(owner, cast("asyncio.AbstractEventLoop", clock))
    connection.connection_made(transport)
    connection.get_buffer(-1)[:1] = b"G"
    connection.buffer_updated(1)
    assert not clock.timers
    transport.unread = 1000
    connection.pause_writing()
    for transport.unread in (900, 200, 1):
        ((seconds, check),) = clock.timers
        assert seconds == limits.UNREAD_SEC
        check()
        assert not transport.aborted
    ((_, check),) = clock.timers
    check()
    assert transport.aborted
    assert owner.refusals == [Refusal.UNREAD]
