"""Many idle connections of one process: the handshake is over, keepalive goes on, nothing else happens."""

from __future__ import annotations

import asyncio
import secrets
from typing import TYPE_CHECKING, Any, Final

from actors.config.credentials import find_credentials
from benchmarks.harness.roles.parent import Load
from proto import limits
from proto.aio.channel import Channel
from proto.aio.connecting import connect as open_connection
from proto.wire import frames
from proto.wire.session import Role
from proto.wire.url import parse_urls

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent
    from proto.errors import ProtocolError
    from proto.wire.frames import Frame

AT_ONCE: Final = 100
"""Connections that are being made at the same time: a broker's backlog is limited."""
CONNECT_TIMEOUT_S: Final = 50.0


class IdleLink:
    """A connection that greets and then only answers pings, which its channel does."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.welcome: asyncio.Future[None] = loop.create_future()
        self.channel = Channel(Role.CLIENT, self, loop=loop)

    def opened(self) -> None:
        """ChannelHandler: greet."""
        identity: dict[str, frames.Scalar] = {
            "instance": secrets.token_bytes(limits.INSTANCE_BYTES),
            "token": secrets.token_bytes(limits.INSTANCE_BYTES),
        }
        name: tuple[str, int] | str | None = self.channel.extra_info("peername")
        host = name[0] if isinstance(name, tuple) else ""
        if (token := find_credentials().token_for(host, encrypted=False)) is not None:
            identity["auth"] = token
        self.channel.send(frames.Hello(limits.PROTOCOL_VERSION, identity))

    def frame_received(self, frame: Frame) -> None:
        """ChannelHandler: the broker's welcome ends the handshake."""
        if isinstance(frame, frames.Welcome):
            self.welcome.set_result(None)

    def read_finished(self) -> None:
        """ChannelHandler: nothing to do."""

    def writable(self) -> None:
        """ChannelHandler: nothing to do."""

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: `closed` follows."""

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: a connection that breaks before its welcome has failed."""
        if not self.welcome.done():
            self.welcome.set_exception(error or ConnectionError("the broker has closed the connection"))


async def idle(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Hold `connections` connections until the parent lets go."""
    loop = asyncio.get_running_loop()
    url, files = parse_urls(parameters["url"])[0], find_credentials().tls
    limit = asyncio.Semaphore(AT_ONCE)
    links: list[IdleLink] = []

    async def connect() -> None:
        async with limit:
            link = IdleLink(loop)
            await open_connection(loop, link.channel, url, files)
            await link.welcome
            links.append(link)

    async with asyncio.timeout(CONNECT_TIMEOUT_S), asyncio.TaskGroup() as group:
        for _ in range(parameters["connections"]):
            group.create_task(connect())
    await parent.ready()
    load = Load()
    await parent.gone()
    alive = sum(link.channel.connected for link in links)
    for link in links:
        link.channel.abort()
    return load.figures(alive, connections=alive)
