"""The byte pump: one connection's socket, shared by both ends, and proto's only door to asyncio.

A `Channel` reads whole frames out of a stream, checks them against the session's table, puts fragments
together and hands frames to its handler; what waits in its outbox it writes while the transport has room.

All channels of a thread read into one scratch buffer, which is safe because `buffer_updated` has taken
everything out of it before the loop can read for another: an idle connection owns no buffer at all.
"""

from __future__ import annotations

import asyncio
import socket
import threading
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
_GATHER_BYTES: Final = limits.HIGH_WATER_BYTES // 2
"""Small frames are written together up to this size: a system call costs more than the copy."""


class _Scratch(threading.local):
    """The thread's read buffer: while one thread's loop is in recv, another's may run."""

    def __init__(self) -> None:
        self.view = memoryview(bytearray(_SCRATCH_BYTES))


_scratch: Final = _Scratch()

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
        self._scratch = _scratch.view
        self._rest = b""
        self._paused = False
        self._flush_due = False
        self._linger: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._scratch = _scratch.view
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(high=limits.HIGH_WATER_BYTES, low=limits.LOW_WATER_BYTES)
        _tune(transport.get_extra_info("socket"))
        self._handler.opened()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._transport = None
        if self._linger is not None:
            self._linger.cancel()
        self._handler.closed(exc)

    def eof_received(self) -> bool:
        """Called by asyncio; a half-closed connection is of no use to either side."""
        return False

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio: the scratch buffer behind what is left of an incomplete frame."""
        start = len(self._rest)
        if start:
            self._scratch[:start] = self._rest
        return self._scratch[start:]

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio: take the frames out and hand them over."""
        if not self.connected:
            return
        self.last_received = self._loop.time()
        self.bytes_received += nbytes
        start, end = 0, len(self._rest) + nbytes
        self._rest = b""
        try:
            while stop := self._frame_end(start, end):
                raw = bytes(self._scratch[start:stop])
                start = stop
                self._take(decode(raw))
                if not self.connected:
                    self.close()
                    return
            self._rest = bytes(self._scratch[start:end])
        except ProtocolError as error:
            self.fail(error)
        finally:
            self._handler.batch_received()

    def _frame_end(self, start: int, end: int) -> int:
        """Return where the frame at `start` ends, or 0 if it is not there whole.

        The limit is looked up frame by frame: the first of a read may be the one that opens the session.
        """
        if start == end:
            return 0
        scratch = self._scratch
        if scratch[start] != BIN_32:
            raise ProtocolError(ErrorCode.MALFORMED, f"not a frame: starts with {scratch[start]:#04x}")
        if end - start < limits.PREFIX_BYTES:
            return 0
        size = int.from_bytes(scratch[start + 1 : start + limits.PREFIX_BYTES], "big")
        most = limits.MAX_FRAME_BYTES if self.session.is_open else limits.MAX_HELLO_BYTES
        if size > most:
            raise ProtocolError(ErrorCode.TOO_LARGE, f"a frame of {size} bytes is over the limit of {most}")
        stop = start + limits.PREFIX_BYTES + size
        return stop if stop <= end else 0

    def _take(self, frame: Frame) -> None:
        self.session.received(frame)
        if isinstance(frame, frames.Fragment):
            raw = self._reassembler.add(frame)
            if raw is None:
                return
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
        transport, outbox = self._transport, self.outbox
        if transport is None:
            return
        while not self._paused and not transport.is_closing():
            raw = self._gather()
            if not raw:
                break
            self.last_sent = self._loop.time()
            self.bytes_sent += len(raw)
            transport.write(raw)
        outbox.trim()

    def _gather(self) -> bytes:
        """Take what is to be written next out of the outbox: one frame, or several small ones."""
        frame = self.outbox.next()
        parts: list[bytes] = []
        size = 0
        while frame is not None:
            parts.append(frame)
            size += len(frame)
            frame = self.outbox.next() if size < _GATHER_BYTES else None
        return parts[0] if len(parts) == 1 else b"".join(parts)

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
        transport = self._transport
        return transport is not None and self.session.state is not State.CLOSED and not transport.is_closing()

    def fileno(self) -> int | None:
        """Return the socket's descriptor, or None without a connection."""
        sock = None if self._transport is None else self._transport.get_extra_info("socket")
        return None if sock is None else sock.fileno()

    def fail(self, error: ProtocolError) -> None:
        """Tell the peer why, and close."""
        if self._transport is None or not self.connected:
            return
        farewell = frames.Error(error.code, str(error)[: limits.MAX_ERROR_TEXT])
        self.session.sent(farewell)
        self._transport.write(encode(farewell))
        self._handler.failed(error)
        self.close()

    def close(self) -> None:
        """Close once everything written so far has gone out, or after `limits.CLOSE_TIMEOUT_SEC`."""
        transport = self._transport
        if transport is not None and not transport.is_closing():
            self._linger = self._loop.call_later(limits.CLOSE_TIMEOUT_SEC, transport.abort)
            transport.close()

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
