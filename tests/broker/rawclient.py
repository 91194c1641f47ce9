"""A client without a node: a channel over a real socket, and raw streams for those who speak no protocol."""

from __future__ import annotations

import asyncio
import contextlib
import os
from typing import TYPE_CHECKING, Final, TypeVar, cast

from proto import limits
from proto.aio.arena import read_token
from proto.aio.channel import Channel
from proto.aio.local_socket import connect_beside
from proto.aio.session_proof import connection_ends, session_proof
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.fragments import Reassembler
from proto.wire.session import Role
from proto.wire.url import parse_url
from tests import waiting

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from broker.server import Broker
    from proto.errors import ProtocolError

F = TypeVar("F")

DEADLINE_SEC: Final = waiting.DEADLINE_SEC
until: Final = waiting.until


class RawClient:
    """One link: sends frames, keeps what it reads, and lets tests wait for a kind of frame.

    Attributes:
        channel: The link's channel.
        ended: Done when the connection is gone.
        problem: What the broker did that the protocol does not allow.
    """

    def __init__(self, *, max_message_bytes: int = limits.MAX_MESSAGE_BYTES) -> None:
        loop = asyncio.get_running_loop()
        self.channel = Channel(Role.CLIENT, self, loop=loop, reassembler=Reassembler(max_message_bytes))
        self.ended = loop.create_future()
        self.problem: ProtocolError | None = None
        self._received: asyncio.Queue[frames.Frame] = asyncio.Queue()
        self.transport: asyncio.BaseTransport | None = None

    def opened(self) -> None:
        """ChannelHandler: nothing to do."""

    def frame_received(self, frame: frames.Frame) -> None:
        """ChannelHandler: keep it."""
        self._received.put_nowait(frame)

    def read_finished(self) -> None:
        """ChannelHandler: nothing to do."""

    def writable(self) -> None:
        """ChannelHandler: nothing to do."""

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the broker is wrong."""
        self.problem = error

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection is gone."""
        if not self.ended.done():
            self.ended.set_result(None)

    def send(self, *sent: frames.Frame) -> None:
        """Send frames in this order, whatever their kind."""
        for frame in sent:
            raw = encode(frame)
            if isinstance(frame, (frames.Batch, frames.Request, frames.Reply)):
                self.channel.outbox.put_calls(raw)
            else:
                self.channel.session.sent(frame)
                self.channel.outbox.put_calls(raw)
        self.channel.flush()

    async def next(self, kind: type[F]) -> F:
        """Return the next frame of one kind; earlier others are forgotten."""
        async with asyncio.timeout(DEADLINE_SEC):
            while True:
                frame = await self._received.get()
                if isinstance(frame, kind):
                    return frame

    async def answer(self) -> frames.Error | None:
        """Return the ERROR that answers a HELLO; None for WELCOME."""
        async with asyncio.timeout(DEADLINE_SEC):
            while True:
                frame = await self._received.get()
                if isinstance(frame, frames.Error):
                    return frame
                if isinstance(frame, frames.Welcome):
                    return None

    def waiting(self, kind: type[F]) -> list[F]:
        """Return what has come already, of one kind; the rest is forgotten."""
        found: list[F] = []
        while not self._received.empty():
            frame = self._received.get_nowait()
            if isinstance(frame, kind):
                found.append(frame)
        return found

    async def synchronise(self) -> None:
        """Return when the broker has handled everything sent before."""
        token = int.from_bytes(os.urandom(6), "big")
        self.send(frames.Ping(token))
        while (await self.next(frames.Pong)).token != token:
            pass

    async def gone(self) -> None:
        """Return when the connection has ended."""
        async with asyncio.timeout(DEADLINE_SEC):
            await asyncio.shield(self.ended)

    def stop_reading(self) -> None:
        """Leave what comes in the socket."""
        assert isinstance(self.transport, asyncio.ReadTransport)
        self.transport.pause_reading()

    def go_on_reading(self) -> None:
        """Read again."""
        assert isinstance(self.transport, asyncio.ReadTransport)
        self.transport.resume_reading()

    @contextlib.asynccontextmanager
    async def connected(self, broker: Broker, *, beside: bool = False) -> AsyncIterator[RawClient]:
        """Be connected to a broker, without a word said yet; with `beside`, at the socket beside its port."""
        loop, url = asyncio.get_running_loop(), parse_url(broker.url)
        if beside:
            sock = connect_beside(url.host, url.port)
            self.transport, _ = await loop.create_unix_connection(lambda: self.channel, sock=sock)
        elif url.path:
            self.transport, _ = await loop.create_unix_connection(lambda: self.channel, url.path)
        else:
            self.transport, _ = await loop.create_connection(lambda: self.channel, url.host, url.port)
        try:
            yield self
        finally:
            self.channel.abort()
            await self.gone()


def hello(**options: frames.Scalar) -> frames.Hello:
    """Return a proper HELLO."""
    identity: dict[str, frames.Scalar] = {"instance": os.urandom(16), "token": os.urandom(16)}
    return frames.Hello(limits.PROTOCOL_VERSION, identity | options)


def proof_for(welcome: frames.Welcome, channel: Channel) -> frames.Proof:
    """Return the PROOF that a WELCOME with shared memory asks for, on this connection."""
    process, number, session = (
        int(cast("int", welcome.options[key])) for key in ("secret_process", "secret_descriptor", "session")
    )
    ends = connection_ends(channel.extra_info, client=True)
    return frames.Proof(session_proof(read_token(process, number), session, ends))


@contextlib.asynccontextmanager
async def link(broker: Broker, node: str | None = None, **options: frames.Scalar) -> AsyncIterator[RawClient]:
    """Have an open session; with a name, a node declared under id 0; with a `host`, shared memory."""
    async with RawClient().connected(broker) as client:
        client.send(hello(**options))
        welcome = await client.next(frames.Welcome)
        if "secret_process" in welcome.options:
            client.send(proof_for(welcome, client.channel))
        if node is not None:
            client.send(frames.Node(0, node))
            assert await client.next(frames.Accepted) == frames.Accepted(0, 0)
        yield client


async def read_error(reader: asyncio.StreamReader) -> frames.Error | None:
    """Read until the broker closes; return the ERROR it sent, None if it just closed."""
    data = b""
    async with asyncio.timeout(DEADLINE_SEC):
        with contextlib.suppress(ConnectionError):
            while chunk := await reader.read(65536):
                data += chunk
    while data:
        end = limits.PREFIX_BYTES + int.from_bytes(data[1 : limits.PREFIX_BYTES], "big")
        frame, data = decode(data[:end]), data[end:]
        if isinstance(frame, frames.Error):
            return frame
    return None


@contextlib.asynccontextmanager
async def stream(broker: Broker) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Have a connection on which any bytes can be sent."""
    url = parse_url(broker.url)
    reader, writer = await asyncio.open_connection(url.host, url.port)
    try:
        yield reader, writer
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


GREETING_BYTES = encode(frames.Hello(limits.PROTOCOL_VERSION, {"instance": b"i" * 16, "token": b"t" * 16}))
"""A HELLO as it goes on the wire."""


async def read_frame(reader: asyncio.StreamReader) -> frames.Frame:
    """Read one frame from a stream."""
    async with asyncio.timeout(DEADLINE_SEC):
        head = await reader.readexactly(limits.PREFIX_BYTES)
        return decode(head + await reader.readexactly(int.from_bytes(head[1:], "big")))
