"""The byte pump: one connection's socket, shared by both ends, and proto's door to asyncio.

A `Channel` reads whole frames out of a stream, checks them against the session's table, puts fragments
together and hands frames to its handler; what waits in its outbox it writes while the transport has room.

All channels of a thread read into one scratch buffer, which is safe because `buffer_updated` has taken
everything out of it before the loop can read for another: an idle connection owns no buffer at all. A large
frame is received into a buffer of its own instead, which becomes the frame.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from typing import TYPE_CHECKING, Final, Protocol, cast

from proto import frames, limits
from proto.codec import BIN_32, Decoder, encode
from proto.errors import ErrorCode, ProtocolError
from proto.fragments import Reassembler
from proto.outbox import Outbox
from proto.session import Role, Session, State

if TYPE_CHECKING:
    from proto.frames import Buffer, Frame

_SCRATCH_BYTES: Final = 2 * (limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES)

_OWN_BYTES: Final = 96 * 1024
"""A frame from this size on is received into a buffer of its own; copying a smaller one out of the scratch
buffer costs less than a read of its own."""

_CLAIM_RATIO: Final = 8
"""It gets one when this part of it has come: a claim alone must cost the peer something."""

_BEHIND_BYTES: Final = 4 * 1024
"""Room behind a frame in a buffer of its own: the read that ends it may get the next one's start, too."""

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
        self.view = memoryview(bytearray(_SCRATCH_BYTES))
        self.decoder = Decoder()


_scratch: Final = _Scratch()

_OWN_FRAMES: Final = frozenset({frames.Fragment, frames.Abort, frames.Ping})
"""What a channel deals with itself."""

_FRAGMENTABLE: Final = (frames.Batch, frames.Replay, frames.Request, frames.Reply)


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
        connected: Whether there is a connection that this end has not ended.
        reading: Whether frames are being handed over: a flush follows anyway.
        bytes_received, bytes_sent: Totals since the connection was made.
    """

    __slots__ = (
        "_decoder",
        "_flush_due",
        "_going_on",
        "_handler",
        "_held",
        "_in_a_row",
        "_joins",
        "_linger",
        "_loop",
        "_offered",
        "_own",
        "_paused",
        "_reassembler",
        "_rest",
        "_resting",
        "_scratch",
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
        self._reassembler = Reassembler(max_message_bytes)
        self._transport: asyncio.Transport | None = None
        self._scratch = _scratch.view
        self._decoder = _scratch.decoder
        self._rest = b""
        """The start of a frame that is not there whole."""
        self._own: memoryview | None = None
        """The buffer of a large frame that is being received, and ..."""
        self._held = 0
        """... how much of that is filled."""
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
        self._scratch = _scratch.view
        self._decoder = _scratch.decoder
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
        """Called by asyncio: where a large frame goes on, or the scratch buffer behind half a small one."""
        if self._own is not None:
            buffer = self._own[self._held :]
        elif self._rest:
            start = len(self._rest)
            self._scratch[:start] = self._rest
            buffer = self._scratch[start:]
        else:
            buffer = self._scratch
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
            if self._own is None:
                end = len(self._rest) + nbytes
                self._rest = b""
            else:
                end = self._fill_own(nbytes)
            self._take_all(end)
        except ProtocolError as error:
            self.fail(error)
        finally:
            self.reading = False
            self._handler.read_finished()
            if self._flush_due:
                self.flush()
            if self._in_a_row >= _TURN_BYTES:
                self._rest_for_a_turn()

    def _rest_for_a_turn(self) -> None:
        """Let the other connections be read before this one's next bytes."""
        transport = self._transport
        if transport is not None and self.connected and not self._resting:
            self._resting = True
            transport.pause_reading()
            self._go_on_soon()

    def _fill_own(self, nbytes: int) -> int:
        """Go on with a large frame; return how many bytes behind it are in the scratch buffer now."""
        own = self._own
        assert own is not None
        self._held += nbytes
        size = len(own) - _BEHIND_BYTES
        behind = self._held - size
        if behind < 0:
            return 0
        self._own = None
        self._scratch[:behind] = own[size : self._held]
        self._take(own[:size].toreadonly())  # as bytes are: what one reader gets, another must not change
        return behind

    def _take_all(self, end: int) -> None:
        """Hand over the frames in the scratch buffer up to `end`; keep what is left of the last."""
        scratch, start = self._scratch, 0
        while start < end and self.connected:
            stop = self._frame_end(start, end)
            if stop > end:
                self._keep(start, end, stop)
                return
            self._take(bytes(scratch[start:stop]))
            start = stop

    def _keep(self, start: int, end: int, stop: int) -> None:
        """Keep the start of a frame of which not all is there."""
        size, here = stop - start, end - start
        if size < _OWN_BYTES or here < size // _CLAIM_RATIO:
            self._rest = bytes(self._scratch[start:end])
            return
        own = self._own = memoryview(bytearray(size + _BEHIND_BYTES))
        own[:here] = self._scratch[start:end]
        self._held = here

    def _frame_end(self, start: int, end: int) -> int:
        """Return where the frame at `start` ends: beyond `end` if it is not there whole.

        The limit is looked up frame by frame: the first of a read may be the one that opens the session.
        """
        scratch = self._scratch
        if scratch[start] != BIN_32:
            raise ProtocolError(ErrorCode.MALFORMED, f"not a frame: starts with {scratch[start]:#04x}")
        body = start + limits.PREFIX_BYTES
        if body > end:
            return body
        size = int.from_bytes(scratch[start + 1 : body], "big")
        most = limits.MAX_FRAME_BYTES if self.session.is_open else limits.MAX_HELLO_BYTES
        if size > most:
            raise ProtocolError(ErrorCode.TOO_LARGE, f"a frame of {size} bytes is over the limit of {most}")
        return body + size

    def _take(self, raw: Buffer) -> None:
        """Hand over one frame."""
        frame = self._decoder.decode_content(raw)
        self.session.received(frame)
        if type(frame) not in _OWN_FRAMES:
            self._handler.frame_received(frame)
        elif isinstance(frame, frames.Fragment):
            self._take_fragment(frame)
        elif isinstance(frame, frames.Abort):
            self._reassembler.abort(frame)
        elif isinstance(frame, frames.Ping):
            self.send(frames.Pong(frame.token))
        if self.session.state is State.CLOSED:
            self.close()

    def _take_fragment(self, fragment: frames.Fragment) -> None:
        raw = self._reassembler.add(fragment)
        if raw is None:
            return
        frame = self._decoder.decode(memoryview(raw).toreadonly())
        if not isinstance(frame, _FRAGMENTABLE):
            name = type(frame).__name__.upper()
            raise ProtocolError(ErrorCode.UNEXPECTED, f"{name} must not travel in fragments")
        self.session.received(frame)
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
        outbox.large_room = _TURN_BYTES
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
            self._handler.room()

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

    def fileno(self) -> int | None:
        """Return the socket's descriptor, or None without a connection."""
        sock = None if self._transport is None else self._transport.get_extra_info("socket")
        return None if sock is None else sock.fileno()

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
