"""The byte pump: one connection's socket, shared by both ends, and proto's only door to asyncio.

A `Channel` reads whole frames out of a stream, checks them against the session's table, puts fragments
together and hands frames to its handler; what waits in its outbox it writes while the transport has room.

All channels of a loop read into one scratch buffer, which is safe because `buffer_updated` has taken
everything out of it before the loop can read for another: an idle connection owns no buffer at all.
"""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING, Final, Protocol, cast

from proto import frames, limits
from proto.codec import BIN_32, decode, encode
from proto.errors import ErrorCode, ProtocolError
from proto.fragments import Reassembler
from proto.outbox import Outbox
from proto.session import Role, Session, State

if TYPE_CHECKING:
    from proto.frames import Frame

_SCRATCH_BYTES: Final = 2 * (limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES)
_scratch: Final = bytearray(_SCRATCH_BYTES)
_scratch_view: Final = memoryview(_scratch)

_FRAGMENTABLE: Final = (frames.Run, frames.Replay, frames.Request, frames.Reply)


class ChannelHandler(Protocol):
    """What a channel needs from its owner. Calls never overlap and come in the order of the bytes."""

    def opened(self) -> None:
        """The transport is there; nothing has been read yet."""
        ...

    def frame_received(self, frame: Frame) -> None:
        """One frame that the session allows. A ProtocolError raised here closes the channel with its code."""
        ...

    def batch_received(self) -> None:
        """Every frame of one read has been handed over."""
        ...

    def room(self) -> None:
        """The transport has room again and the outbox has been flushed into it."""
        ...

    def failed(self, error: ProtocolError) -> None:
        """The peer broke the protocol; `closed` follows."""
        ...

    def closed(self, error: Exception | None) -> None:
        """The connection is gone. Called exactly once."""
        ...


class Channel(asyncio.BufferedProtocol):
    """One framed connection.

    Attributes:
        outbox: What waits to be sent; put things in, then call `flush`.
        session: The state of the session.
        last_received, last_sent: Loop times of the last bytes, for the owner's keepalive.
        bytes_received, bytes_sent: Totals since the connection was made.
    """

    def __init__(
        self,
        role: Role,
        handler: ChannelHandler,
        *,
        loop: asyncio.AbstractEventLoop,
        max_message_bytes: int = limits.MAX_MESSAGE_BYTES,
    ) -> None:
        self.outbox = Outbox()
        self.session = Session(role)
        self.bytes_received = 0
        self.bytes_sent = 0
        self._handler = handler
        self._loop = loop
        self.last_received = self.last_sent = loop.time()
        self._reassembler = Reassembler(max_message_bytes)
        self._transport: asyncio.Transport | None = None
        self._rest = b""
        self._paused = False
        self._flush_due = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(high=limits.HIGH_WATER_BYTES, low=limits.LOW_WATER_BYTES)
        _tune(transport.get_extra_info("socket"))
        self._handler.opened()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._transport = None
        self._handler.closed(exc)

    def eof_received(self) -> bool:
        """Called by asyncio; a half-closed connection is of no use to either side."""
        return False

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio: the scratch buffer behind what is left of an incomplete frame."""
        start = len(self._rest)
        if start:
            _scratch[:start] = self._rest
        return _scratch_view[start:]

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio: take the frames out and hand them over."""
        self.last_received = self._loop.time()
        self.bytes_received += nbytes
        received: list[bytes] = []
        problem: ProtocolError | None = None
        try:
            self._split(len(self._rest) + nbytes, received)
        except ProtocolError as error:
            problem = error
        try:
            for raw in received:
                self._take(decode(raw))
                if self._transport is None or self.session.state is State.CLOSED:
                    return
            if problem is not None:
                raise problem
        except ProtocolError as error:
            self.fail(error)
        finally:
            self._handler.batch_received()

    def _split(self, end: int, received: list[bytes]) -> None:
        """Copy each whole frame out of the scratch buffer; keep the start of an incomplete one."""
        opened = self.session.state in {State.OPEN, State.CLOSING}
        most = limits.MAX_FRAME_BYTES if opened else limits.MAX_HELLO_BYTES
        start = 0
        while end - start >= limits.PREFIX_BYTES:
            if _scratch[start] != BIN_32:
                raise ProtocolError(ErrorCode.MALFORMED, f"not a frame: starts with {_scratch[start]:#04x}")
            size = int.from_bytes(_scratch_view[start + 1 : start + 5], "big")
            if size > most:
                raise ProtocolError(
                    ErrorCode.TOO_LARGE, f"a frame of {size} bytes is over the limit of {most}"
                )
            stop = start + limits.PREFIX_BYTES + size
            if stop > end:
                break
            received.append(bytes(_scratch_view[start:stop]))
            start = stop
        if start < end and _scratch[start] != BIN_32:
            raise ProtocolError(ErrorCode.MALFORMED, f"not a frame: starts with {_scratch[start]:#04x}")
        self._rest = bytes(_scratch_view[start:end])

    def _take(self, frame: Frame) -> None:
        self.session.received(frame)
        if isinstance(frame, frames.Fragment):
            raw = self._reassembler.add(frame)
            if raw is None:
                return
            if int.from_bytes(raw[1 : limits.PREFIX_BYTES], "big") != len(raw) - limits.PREFIX_BYTES:
                raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: the parts are not one frame")
            frame = decode(raw)
            if not isinstance(frame, _FRAGMENTABLE):
                name = type(frame).__name__.upper()
                raise ProtocolError(ErrorCode.UNEXPECTED, f"{name} must not travel in fragments")
            self.session.received(frame)
        elif isinstance(frame, frames.Abort):
            self._reassembler.abort(frame)
            return
        elif isinstance(frame, frames.Ping):
            self.send(frames.Pong(frame.token))
            return
        self._handler.frame_received(frame)

    def send(self, frame: Frame) -> None:
        """Queue a control frame ahead of calls and runs; it leaves with the next flush."""
        self.session.sent(frame)
        self.outbox.put_control(encode(frame))
        self.flush_soon()

    def flush_soon(self) -> None:
        """Flush at the end of this loop turn, once, however often this is called."""
        if not self._flush_due:
            self._flush_due = True
            self._loop.call_soon(self.flush)

    def flush(self) -> None:
        """Write what waits, as far as the transport has room; trim the rest to its depth."""
        self._flush_due = False
        transport = self._transport
        if transport is None:
            return
        outbox = self.outbox
        while not self._paused:
            raw = outbox.next()
            if raw is None:
                outbox.settle()
                return
            self.last_sent = self._loop.time()
            self.bytes_sent += len(raw)
            transport.write(raw)
        outbox.trim()

    def pause_writing(self) -> None:
        """Called by asyncio: the transport is full."""
        self._paused = True

    def resume_writing(self) -> None:
        """Called by asyncio: the transport has room."""
        self._paused = False
        self.flush()
        if not self._paused:
            self._handler.room()

    @property
    def busy(self) -> bool:
        """Whether the transport is full, so that what is queued waits."""
        return self._paused

    @property
    def connected(self) -> bool:
        """Whether there is a connection that may still carry frames."""
        return self._transport is not None and self.session.state is not State.CLOSED

    def fail(self, error: ProtocolError) -> None:
        """Tell the peer why, and close."""
        if self._transport is None or self.session.state is State.CLOSED:
            return
        farewell = frames.Error(error.code, str(error)[: limits.MAX_ERROR_TEXT])
        self.session.sent(farewell)
        self._transport.write(encode(farewell))
        self._handler.failed(error)
        self.close()

    def close(self) -> None:
        """Close once everything written so far has gone out."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Close now, whatever is still unsent."""
        if self._transport is not None:
            self._transport.abort()


def _tune(sock: socket.socket | None) -> None:
    """Keep what the kernel buffers unsent small, and let small frames go at once."""
    if sock is None or sock.family not in {socket.AF_INET, socket.AF_INET6}:
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    lowat = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if lowat is not None:
        sock.setsockopt(socket.IPPROTO_TCP, lowat, limits.NOTSENT_LOWAT_BYTES)
