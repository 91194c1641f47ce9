"""One connection's socket, for both ends: an asyncio protocol around a `Receiver` and an `Outbox`.

A `Channel` passes each received frame to its handler and writes the frames of its outbox until the transport
is full (asyncio's `pause_writing`). All channels of a thread share one scratch buffer, which is safe because
`buffer_updated` empties it before the event loop reads for another channel. Brokers use a `BudgetedChannel`.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from proto import limits
from proto.errors import ProtocolError
from proto.queues.outbox import Outbox
from proto.wire import frames
from proto.wire.codec import Decoder, encode
from proto.wire.fragments import ByteTotal, Reassembler
from proto.wire.receiver import PARTS, SCRATCH_BYTES, Receiver
from proto.wire.session import Role, Session, State

if TYPE_CHECKING:
    from proto.wire.frames import Frame

GATHER_BYTES: Final = 2 * limits.HIGH_WATER_BYTES
"""Frames are written together up to this size. One write of it fills an idle transport, so that the rest
stays in the outbox, where depth and credit still apply: what the transport has cannot be dropped any more."""

TURN_BYTES: Final = 256 * 1024
"""Bytes that one connection may read in a row, or write of large frames, before the other connections are
served. A small message waits for at most this much of a large one."""

_JOIN_BYTES: Final = 64 * 1024
"""Up to this size, joining frames is cheaper than passing them to the kernel one by one."""


class _Scratch(threading.local):
    """The buffer and the decoder that the channels of one thread share."""

    def __init__(self) -> None:
        self.view = memoryview(bytearray(SCRATCH_BYTES))
        self.decoder = Decoder()


_scratch: Final = _Scratch()


class ChannelHandler(Protocol):
    """The callbacks of a channel's owner. They never overlap and follow the order of the received bytes."""

    def opened(self) -> None:
        """Handle a new connection, before anything is read."""
        ...

    def frame_received(self, frame: Frame) -> None:
        """Handle a frame that the session allows; a ProtocolError closes the channel with its code."""
        ...

    def read_finished(self) -> None:
        """Handle the end of one read, or of one share of it, after its frames."""
        ...

    def writable(self) -> None:
        """Handle that the outbox has been flushed and the transport takes more."""
        ...

    def failed(self, error: ProtocolError) -> None:
        """Handle a protocol error of the peer; `closed` follows."""
        ...

    def closed(self, error: Exception | None) -> None:
        """Handle the end of the connection. Called exactly once."""
        ...


class _NoHandler:
    """The handler of a channel that has ended."""

    def ignore(self, *_event: object) -> None:
        """Do nothing."""

    opened = frame_received = read_finished = writable = failed = closed = ignore


class Channel(asyncio.BufferedProtocol):
    """One framed connection.

    Args:
        role: Which end of the link this is.
        handler: Gets the received frames and the events of the connection.
        loop: The event loop that owns the transport.
        reassembler: Joins the fragments of the peer's large messages; None for one with the default limits.
        received: Counts the buffers of received bytes of several channels; None for a count of its own.

    Attributes:
        reassembler: As given, or made.
        outbox: The frames to send; put frames in, then call `flush` or `flush_soon`.
        session: The state of the session.
        connected: Whether there is a connection that this end has not ended.
        reading: Whether received frames are being handled; a flush that is due follows afterwards.
        busy: Whether the transport is full, so that queued frames wait.
        bytes_received, bytes_sent: Totals since the connection was made.
    """

    __slots__ = (
        "_continue_due",
        "_flush_due",
        "_handler",
        "_in_a_row",
        "_joins",
        "_linger",
        "_loop",
        "_offered",
        "_reading_paused",
        "_received",
        "_receiver",
        "_transport",
        "busy",
        "bytes_received",
        "bytes_sent",
        "connected",
        "outbox",
        "reading",
        "reassembler",
        "session",
    )

    def __init__(
        self,
        role: Role,
        handler: ChannelHandler,
        *,
        loop: asyncio.AbstractEventLoop,
        reassembler: Reassembler | None = None,
        received: ByteTotal | None = None,
    ) -> None:
        self.outbox = Outbox()
        self.reassembler = reassembler or Reassembler()
        self.session = Session(role)
        self.connected = False
        self.reading = False
        self.bytes_received: int = 0
        self.bytes_sent = 0
        self._handler = handler
        self._loop = loop
        # writelines of asyncio's own transports does not call pause_writing before Python 3.12.9 and 3.13.2
        # (CVE-2024-12254), and in 3.11 it joins the parts anyway.
        self._joins = isinstance(loop, asyncio.BaseEventLoop)
        self._received = received
        self._receiver: Receiver | None = None
        self._transport: asyncio.Transport | None = None
        self.busy = False
        self._flush_due = False
        self._continue_due = False
        self._offered = 0
        """Size of the buffer of the last read."""
        self._in_a_row = 0
        """Bytes of consecutive reads that filled their buffers: the loop reads on from such a peer."""
        self._reading_paused = False
        """Whether reading is paused until the next loop turn."""
        self._linger: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._receiver = Receiver(
            self.session, _scratch.view, _scratch.decoder, self.reassembler, self._received
        )
        self._transport = cast("asyncio.Transport", transport)
        self.connected = True
        self._transport.set_write_buffer_limits(high=limits.HIGH_WATER_BYTES, low=limits.LOW_WATER_BYTES)
        _set_socket_options(transport.get_extra_info("socket"))
        self._handler.opened()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._transport = None
        self.connected = False
        # After `close` only: the transport has sent everything, or was aborted.
        if self._linger is not None:
            self._linger.cancel()
        handler, self._handler = self._handler, _NO_HANDLER
        handler.closed(exc)
        # The handler is gone, so no reference cycle is left: memory is freed without the garbage collector.
        if self._receiver is not None:
            self._receiver.discard()
        self._receiver = None
        self.reassembler.clear()

    def eof_received(self) -> bool:
        """Called by asyncio; treat a half-closed connection as closed.

        Otherwise the transport would wait without a limit for a peer that does not read.
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
        """Called by asyncio: decode the received frames and pass them to the handler."""
        if not self.connected:
            return
        self.bytes_received += nbytes
        self._in_a_row = self._in_a_row + nbytes if nbytes == self._offered else 0
        self.reading = True
        try:
            self._handle_frames(nbytes)
        except ProtocolError as error:
            self.fail(error)
        finally:
            # The handler first: what it does at the end of a read (a router's reports, the replies of
            # callbacks) leaves with the same write as what the frames themselves have caused.
            self.reading = False
            self._handler.read_finished()
            if self._flush_due:
                self.flush()
            if self._in_a_row >= TURN_BYTES and not self._reading_paused and self.connected:
                # Let the event loop read from the other connections before this one.
                assert self._transport is not None
                self._reading_paused = True
                self._transport.pause_reading()
                self._continue_soon()

    def _handle_frames(self, nbytes: int) -> None:
        """Handle the frames that the last `nbytes` bytes complete."""
        receiver, handler, session = self._receiver, self._handler, self.session
        assert receiver is not None
        receiver.received(nbytes)
        # A handler may close the connection: the frames behind that are not handled.
        while self.connected and (frame := receiver.next_frame()) is not None:
            if type(frame) is frames.Ping:
                self.send(frames.Pong(frame.token))
            elif type(frame) not in PARTS:
                handler.frame_received(frame)
            if session.state is State.CLOSED:
                self.close()

    def send(self, frame: Frame) -> None:
        """Queue a control frame, to be sent with the next flush before calls and batches."""
        self.session.sent(frame)
        self.outbox.put_control(encode(frame))
        self.flush_soon()

    def flush_soon(self) -> None:
        """Flush at the end of this loop turn, once, however often this is called."""
        if not self._flush_due:
            self._flush_due = True
            if not self.reading:  # otherwise the end of the read flushes
                self._loop.call_soon(self._flush_if_due)

    def _flush_if_due(self) -> None:
        if self._flush_due:
            self.flush()

    def flush(self) -> None:
        """Write queued frames until the transport is full, then trim the publisher queues."""
        self._flush_due = False
        transport, outbox = self._transport, self.outbox
        if transport is None:
            return
        outbox.large_budget = TURN_BYTES
        # `write` may set `busy` (`pause_writing`), or find out that the connection is gone.
        while not self.busy and not transport.is_closing():
            parts, size = outbox.pop_frames(GATHER_BYTES)
            if not parts:
                break
            self.bytes_sent += size
            if len(parts) == 1:
                transport.write(parts[0])
            elif size <= _JOIN_BYTES or self._joins:
                transport.write(b"".join(parts))
            else:
                transport.writelines(parts)
            if size < GATHER_BYTES:
                break
        # Only now: what is still there could not be sent.
        outbox.trim()
        if outbox.has_more and not self.busy:  # large frames beyond this turn's budget
            self._continue_soon()

    def _continue_soon(self) -> None:
        """Continue with large frames, and with reading, in the next loop turn."""
        if not self._continue_due:
            self._continue_due = True
            self._loop.call_soon(self._continue)

    def _continue(self) -> None:
        self._continue_due = False
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if self._reading_paused:
            self._reading_paused = False
            self._in_a_row = 0
            transport.resume_reading()
        if not self.busy:
            self.flush()
            self._handler.writable()

    def pause_writing(self) -> None:
        """Called by asyncio: the transport is full."""
        self.busy = True

    def resume_writing(self) -> None:
        """Called by asyncio: the transport takes more."""
        self.busy = False
        self.flush()
        if not self.busy:
            self._handler.writable()

    def extra_info(self, name: str) -> Any:
        """Return what the transport knows under a name; None without a connection."""
        return None if self._transport is None else self._transport.get_extra_info(name)

    def descriptors(self) -> tuple[int, ...]:
        """Return the socket's descriptor, if there is a connection (DescriptorOwner)."""
        sock = self.extra_info("socket")
        return () if sock is None or sock.fileno() < 0 else (sock.fileno(),)

    def fail(self, error: ProtocolError) -> None:
        """Send the peer an ERROR frame and close.

        The frame does not wait in the outbox: the peer should learn the reason even if it has broken a limit
        of what may wait there.
        """
        if self._transport is None or not self.connected or self._transport.is_closing():
            return
        error_frame = frames.Error(error.code, str(error)[: limits.MAX_ERROR_TEXT])
        self.session.sent(error_frame)
        self._transport.write(encode(error_frame))
        self._handler.failed(error)
        self.close()

    def close(self) -> None:
        """Close when everything written so far is sent, or after `limits.CLOSE_TIMEOUT_SEC`.

        Without a limit a peer that does not read would keep the connection, and its buffers, forever.
        """
        self.connected = False
        transport = self._transport
        if transport is not None and not transport.is_closing():
            self._linger = self._loop.call_later(limits.CLOSE_TIMEOUT_SEC, transport.abort)
            transport.close()

    def abort(self) -> None:
        """Close at once and discard unsent bytes."""
        self.connected = False
        if self._transport is not None:
            self._transport.abort()


_NO_HANDLER: Final = _NoHandler()


def _set_socket_options(sock: socket.socket | None) -> None:
    """Send small frames at once, and limit what the kernel buffers unsent."""
    if sock is None or sock.family not in {socket.AF_INET, socket.AF_INET6}:
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    # What the kernel holds cannot be dropped or overtaken any more, so it should hold little.
    lowat = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if lowat is not None:
        sock.setsockopt(socket.IPPROTO_TCP, lowat, limits.NOTSENT_LOWAT_BYTES)
