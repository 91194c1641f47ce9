"""One connection's socket, for both ends: an asyncio protocol around a `Receiver` and an `Outbox`.

A `Channel` hands the frames that its receiver cuts out of the stream to its handler, and writes what waits in
its outbox while the transport has room. All channels of a thread share one scratch buffer, which is safe
because `buffer_updated` takes everything out of it before the loop can read for another.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from typing import TYPE_CHECKING, Final, Protocol, cast

from proto import frames, limits
from proto.codec import Decoder, encode
from proto.errors import ProtocolError
from proto.outbox import Outbox
from proto.receiver import SCRATCH_BYTES, Receiver
from proto.session import Role, Session, State

if TYPE_CHECKING:
    from proto.frames import Frame

_GATHER_BYTES: Final = 2 * limits.HIGH_WATER_BYTES
"""Frames are written together up to this size."""

_TURN_BYTES: Final = 256 * 1024
"""What one connection may read in a row, or write of large messages, before the others get their turn: a
small message waits behind this much of a large one."""

_JOIN_BYTES: Final = 64 * 1024
"""Up to this size copying frames together costs less than handing them to the kernel one by one."""


class _Scratch(threading.local):
    """What a thread's channels share: while one thread's loop is in recv, another's may run."""

    def __init__(self) -> None:
        self.view = memoryview(bytearray(SCRATCH_BYTES))
        self.decoder = Decoder()


_scratch: Final = _Scratch()


class ChannelHandler(Protocol):
    """What a channel needs from its owner. Calls never overlap and come in the order of the bytes."""

    def opened(self) -> None:
        """The transport is there; nothing has been read yet."""
        ...

    def frame_received(self, frame: Frame) -> None:
        """One frame that the session allows. A ProtocolError raised here closes the channel with its code."""
        ...

    def read_finished(self) -> None:
        """Every frame of one read has been handed over."""
        ...

    def writable(self) -> None:
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
        connected: Whether there is a connection that this end has not ended.
        reading: Whether frames are being handed over: a flush follows anyway.
        bytes_received, bytes_sent: Totals since the connection was made.
    """

    __slots__ = (
        "_flush_due",
        "_going_on",
        "_handler",
        "_in_a_row",
        "_joins",
        "_linger",
        "_loop",
        "_max_message_bytes",
        "_offered",
        "_paused",
        "_receiver",
        "_resting",
        "_transport",
        "bytes_received",
        "bytes_sent",
        "connected",
        "outbox",
        "reading",
        "session",
    )

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
        self.connected = False
        self.reading = False
        self.bytes_received = 0
        self.bytes_sent = 0
        self._handler = handler
        self._loop = loop
        # writelines of asyncio's own transports never says that they are full before Python 3.12.9 and 3.13.2
        # (CVE-2024-12254); in 3.11 it joins, too.
        self._joins = isinstance(loop, asyncio.BaseEventLoop)
        self._max_message_bytes = max_message_bytes
        self._receiver: Receiver | None = None
        self._transport: asyncio.Transport | None = None
        self._paused = False
        self._flush_due = False
        self._going_on = False
        self._offered = 0
        """The size of the buffer that the last read got."""
        self._in_a_row = 0
        """Bytes of reads in a row that filled their buffers: the loop goes on reading from such a peer."""
        self._resting = False
        """Whether reading has been stopped for the rest of this loop turn."""
        self._linger: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._receiver = Receiver(
            self.session, _scratch.view, _scratch.decoder, max_message_bytes=self._max_message_bytes
        )
        self._transport = cast("asyncio.Transport", transport)
        self.connected = True
        self._transport.set_write_buffer_limits(high=limits.HIGH_WATER_BYTES, low=limits.LOW_WATER_BYTES)
        _tune(transport.get_extra_info("socket"))
        self._handler.opened()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._transport = None
        self.connected = False
        if self._linger is not None:
            self._linger.cancel()
        self._handler.closed(exc)

    def eof_received(self) -> bool:
        """Called by asyncio; a half-closed connection is of no use to either side.

        Left to itself the transport would wait for ever until a peer that does not read has taken what waits.
        """
        self.close()
        return False

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio."""
        assert self._receiver is not None
        buffer = self._receiver.buffer()
        self._offered = len(buffer)
        return buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio: take the frames out and hand them over."""
        if not self.connected:
            return
        self.bytes_received += nbytes
        self._in_a_row = self._in_a_row + nbytes if nbytes == self._offered else 0
        self.reading = True
        try:
            self._take_frames(nbytes)
        except ProtocolError as error:
            self.fail(error)
        finally:
            self.reading = False
            self._handler.read_finished()
            if self._flush_due:
                self.flush()
            if self._in_a_row >= _TURN_BYTES:
                self._rest_for_a_turn()

    def _take_frames(self, nbytes: int) -> None:
        """Hand over the frames that so many new bytes complete."""
        receiver, handler, session = self._receiver, self._handler, self.session
        assert receiver is not None
        receiver.received(nbytes)
        while self.connected and (frame := receiver.next_frame()) is not None:
            if type(frame) is frames.Ping:
                self.send(frames.Pong(frame.token))
            else:
                handler.frame_received(frame)
            if session.state is State.CLOSED:
                self.close()

    def _rest_for_a_turn(self) -> None:
        """Let the other connections be read before this one's next bytes."""
        transport = self._transport
        if transport is not None and self.connected and not self._resting:
            self._resting = True
            transport.pause_reading()
            self._go_on_soon()

    def send(self, frame: Frame) -> None:
        """Queue a control frame ahead of calls and runs; it leaves with the next flush."""
        self.session.sent(frame)
        self.outbox.put_control(encode(frame))
        self.flush_soon()

    def flush_soon(self) -> None:
        """Flush at the end of this loop turn, once, however often this is called."""
        if not self._flush_due:
            self._flush_due = True
            if not self.reading:
                self._loop.call_soon(self._flush_if_due)

    def _flush_if_due(self) -> None:
        if self._flush_due:
            self.flush()

    def flush(self) -> None:
        """Write what waits, as far as the transport has room; trim the rest to its depth."""
        self._flush_due = False
        transport, outbox = self._transport, self.outbox
        if transport is None:
            return
        outbox.large_budget = _TURN_BYTES
        while not self._paused and not transport.is_closing():
            parts, size = outbox.take(_GATHER_BYTES)
            if not parts:
                break
            self.bytes_sent += size
            if len(parts) == 1:
                transport.write(parts[0])
            elif size <= _JOIN_BYTES or self._joins:
                transport.write(b"".join(parts))
            else:
                transport.writelines(parts)
            if size < _GATHER_BYTES:
                break
        outbox.trim()
        if outbox.has_more and not self._paused:
            self._go_on_soon()

    def _go_on_soon(self) -> None:
        """Go on with large messages in the next loop turn."""
        if not self._going_on:
            self._going_on = True
            self._loop.call_soon(self._go_on)

    def _go_on(self) -> None:
        self._going_on = False
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if self._resting:
            self._resting = False
            self._in_a_row = 0
            transport.resume_reading()
        if not self._paused:
            self.flush()
            self._handler.writable()

    def pause_writing(self) -> None:
        """Called by asyncio: the transport is full."""
        self._paused = True

    def resume_writing(self) -> None:
        """Called by asyncio: the transport has room."""
        self._paused = False
        self.flush()
        if not self._paused:
            self._handler.writable()

    @property
    def busy(self) -> bool:
        """Whether the transport is full, so that what is queued waits."""
        return self._paused

    @property
    def peer_address(self) -> str:
        """The other end's host and port; "unix socket" for one of a socket file."""
        name = None if self._transport is None else self._transport.get_extra_info("peername")
        return f"{name[0]}:{name[1]}" if isinstance(name, tuple) else "unix socket"

    def descriptors(self) -> tuple[int, ...]:
        """DescriptorOwner: the socket's, if there is a connection."""
        sock = None if self._transport is None else self._transport.get_extra_info("socket")
        return () if sock is None or sock.fileno() < 0 else (sock.fileno(),)

    def fail(self, error: ProtocolError) -> None:
        """Tell the peer why, and close."""
        if self._transport is None or not self.connected or self._transport.is_closing():
            return
        farewell = frames.Error(error.code, str(error)[: limits.MAX_ERROR_TEXT])
        self.session.sent(farewell)
        self._transport.write(encode(farewell))
        self._handler.failed(error)
        self.close()

    def close(self) -> None:
        """Close once everything written so far has gone out, or after `limits.CLOSE_TIMEOUT_SEC`."""
        self.connected = False
        transport = self._transport
        if transport is not None and not transport.is_closing():
            self._linger = self._loop.call_later(limits.CLOSE_TIMEOUT_SEC, transport.abort)
            transport.close()

    def abort(self) -> None:
        """Close now, whatever is still unsent."""
        self.connected = False
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
