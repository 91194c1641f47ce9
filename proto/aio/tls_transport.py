"""TLS between a socket's transport and a channel, for both ends and for every event loop.

asyncio's own TLS opens a connection only after the handshake, so that a broker could neither count nor limit
connections before; it holds 256 KiB for each, and discards the alert that says why a handshake failed. The
cryptography is the standard library's `ssl.SSLObject`; here bytes only go in and out.
"""

from __future__ import annotations

import asyncio
import ssl
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, cast

from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import BIN_32, encode
from proto.wire.fragments import ByteTotal

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.aio.read_budget import ReadBudget, Reader
    from proto.wire.frames import Buffer

_READ_BYTES: Final = 256 * 1024
"""Encrypted bytes that are read at once."""

_CONTENDED_READ_BYTES: Final = 64 * 1024
"""The same while other connections wait for the budget."""

_HANDSHAKE_READ_BYTES: Final = 16 * 1024
"""The same during the handshake: an unknown peer gets no more memory."""

SHARE_RECORDS: Final = 500
"""Records of one connection that are decrypted in one loop turn. A record may have one byte only, and each
costs microseconds."""

_PLAIN_REFUSED: Final = encode(
    frames.Error(ErrorCode.TLS_REQUIRED, "this port speaks TLS: use callboards:// instead of callboard://")
)


class _Scratch(threading.local):
    """The buffer for encrypted bytes that the connections of one thread share."""

    def __init__(self) -> None:
        self.view = memoryview(bytearray(_READ_BYTES))


_scratch: Final = _Scratch()


def _go_on_later(reader: Reader, loop: asyncio.AbstractEventLoop, budget: ReadBudget | None) -> None:
    """Let a reader go on when the budget allows it, without one in the next loop turn."""
    if budget is None:
        loop.call_soon(reader.go_on_reading)
    else:
        budget.wait(reader)


class Cipher:
    """TLS: bytes in, bytes out. Errors are `ssl.SSLError`.

    Args:
        context: Verifies the other end.
        host: The broker's name; None at the broker.
        budget: Counts what handshakes and decryption take.
        total: Counts the buffers of several connections; None for a count of its own.

    Attributes:
        share: Records that may still be decrypted in this loop turn.
        tls: The state of OpenSSL.
        ended: Whether the peer has sent `close_notify`.
    """

    __slots__ = (
        "_budget",
        "_incoming",
        "_largest_input",
        "_largest_output",
        "_outgoing",
        "_partial",
        "_read",
        "_total",
        "ended",
        "share",
        "tls",
    )

    def __init__(
        self, context: ssl.SSLContext, host: str | None, budget: ReadBudget | None, total: ByteTotal | None
    ) -> None:
        self._total = total or ByteTotal()
        self._largest_input = self._largest_output = 0
        self._budget = budget
        self._incoming = ssl.MemoryBIO()
        self._outgoing = ssl.MemoryBIO()
        self.tls = context.wrap_bio(
            self._incoming, self._outgoing, server_side=host is None, server_hostname=host
        )
        self._read = cast("Callable[[int, memoryview], int]", self.tls.read)  # with a buffer: a number
        self._partial = True
        """Whether the rest of the input is less than a record."""
        self.ended = False
        self.share = SHARE_RECORDS

    @property
    def has_input(self) -> bool:
        """Whether there may be something to decrypt."""
        return not (self._partial or self.ended) and bool(self._incoming.pending or self.tls.pending())

    @property
    def held_bytes(self) -> int:
        """Size of its buffers."""
        return self._largest_input + self._largest_output

    def release(self) -> None:
        """Stop counting the buffers, because the connection has ended."""
        self._total.bytes -= self.held_bytes
        self._largest_input = self._largest_output = 0

    def receive(self, data: memoryview) -> None:
        """Add encrypted bytes that have been received."""
        self._incoming.write(data)
        self._partial = False
        size = self._incoming.pending
        if size > self._largest_input:  # OpenSSL never makes a buffer smaller
            self._total.bytes += size - self._largest_input
            self._largest_input = size

    def pop_output(self) -> bytes:
        """Return the encrypted bytes to send."""
        size = self._outgoing.pending
        if size > self._largest_output:
            self._total.bytes += size - self._largest_output
            self._largest_output = size
        return self._outgoing.read() if size else b""

    def handshake(self) -> bool:
        """Continue the handshake; return whether it is over."""
        began = self._clock()
        try:
            self.tls.do_handshake()
        except ssl.SSLWantReadError:
            return False
        finally:
            self._spend(began)
        return True

    def encrypt(self, data: Buffer) -> None:
        """Encrypt bytes."""
        view = memoryview(data)
        while view:
            view = view[self.tls.write(view) :]

    def decrypt(self, buffer: memoryview) -> int:
        """Decrypt until the buffer is full or the share is used up; return the number of bytes."""
        began = self._clock()
        filled = 0
        try:
            while filled < len(buffer) and self.share and self.has_input:
                self.share -= 1
                size = self._read(len(buffer) - filled, buffer[filled:])
                self.ended = not size
                filled += size
        except ssl.SSLWantReadError:
            self._partial = True
        self._spend(began)
        return filled

    def _clock(self) -> float:
        return 0.0 if self._budget is None else self._budget.clock()

    def _spend(self, began: float) -> None:
        budget = self._budget
        if budget is not None:
            budget.spend(budget.clock() - began)

    def finish(self) -> None:
        """Send `close_notify`."""
        with suppress(OSError):  # SSLWantReadError: the peer has not sent its own, and need not
            self.tls.unwrap()


class TlsTransport(asyncio.Transport, asyncio.BufferedProtocol):
    """The protocol of a socket's transport, and the transport of a channel.

    The channel is connected as soon as the socket is. What it writes during the handshake is sent after it;
    if TLS fails, the channel's connection is lost with an `ssl.SSLError`.

    Args:
        channel: The protocol that gets the decrypted bytes.
        context: Verifies the other end.
        loop: The event loop.
        host: The broker's name, which its certificate must have; None at the broker.
        budget: Counts what handshakes and decryption take; what is received when it is exhausted waits, like
            what is more than a share.
        received: Counts the buffers of received bytes and for TLS of all channels of the broker.
    """

    __slots__ = (
        "_budget",
        "_channel",
        "_cipher",
        "_closing",
        "_error",
        "_established",
        "_loop",
        "_paused",
        "_raw",
        "_started",
        "_unsent",
        "_waiting",
    )

    def __init__(
        self,
        channel: asyncio.BufferedProtocol,
        context: ssl.SSLContext,
        *,
        loop: asyncio.AbstractEventLoop,
        host: str | None = None,
        budget: ReadBudget | None = None,
        received: ByteTotal | None = None,
    ) -> None:
        self._budget = budget
        self._channel = channel
        self._loop = loop
        self._cipher = Cipher(context, host, budget, received)
        self._raw: asyncio.Transport | None = None
        self._started = False
        """Whether the peer has sent anything."""
        self._established = self._closing = self._paused = False
        self._waiting = False
        """Whether received bytes wait for the budget."""
        self._unsent: list[bytes] = []
        """Bytes that the channel has written during the handshake."""
        self._error: OSError | None = None

    # The protocol of the socket's transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        self._raw = cast("asyncio.Transport", transport)
        self._channel.connection_made(self)
        if not self._cipher.tls.server_side:
            self._process()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        self._raw = None
        self._closing = True
        self._cipher.release()
        self._channel.connection_lost(self._error or exc)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002
        """Called by asyncio."""
        if not self._established:
            return _scratch.view[:_HANDSHAKE_READ_BYTES]
        contended = self._budget is not None and self._budget.contended
        return _scratch.view[:_CONTENDED_READ_BYTES] if contended else _scratch.view

    def buffer_updated(self, nbytes: int) -> None:
        """Called by asyncio."""
        received = _scratch.view[:nbytes]
        if not self._started:
            self._started = True
            # A client that speaks callboard without TLS reads a frame, so it gets the reason as one.
            if self._cipher.tls.server_side and received[0] == BIN_32 and self._raw is not None:
                self._raw.write(_PLAIN_REFUSED)
                self._end(ssl.SSLError(ssl.SSL_ERROR_SSL, "a client without TLS"))
                return
        self._cipher.receive(received)
        self._process()

    def go_on_reading(self) -> None:
        """Called by the budget, or in the next loop turn without one."""
        self._waiting = False
        if self._raw is not None and not self._raw.is_closing():
            if not self._paused:
                self._raw.resume_reading()
            self._process()

    def eof_received(self) -> bool | None:
        """Called by asyncio."""
        return self._channel.eof_received()

    def pause_writing(self) -> None:
        """Called by asyncio."""
        self._channel.pause_writing()

    def resume_writing(self) -> None:
        """Called by asyncio."""
        self._channel.resume_writing()

    # TLS

    def _process(self) -> None:
        """Continue the handshake; then pass decrypted bytes to the channel until it pauses."""
        cipher, budget, raw = self._cipher, self._budget, self._raw
        cipher.share = 0 if budget is not None and budget.exhausted else SHARE_RECORDS
        try:
            if not self._established and cipher.share and self._error is None and cipher.handshake():
                self._established = True
                for data in self._unsent:
                    cipher.encrypt(data)
                self._unsent.clear()
                if self._closing:
                    self._end()
            stopped = not self._established or self._waiting
            while cipher.share and cipher.has_input and not (stopped or self._paused or self._closing):
                size = cipher.decrypt(cast("memoryview", self._channel.get_buffer(-1)))
                if size:
                    self._channel.buffer_updated(size)
            # Not while the channel keeps bytes, which it would discard.
            if cipher.ended and not (self._paused or self._closing):
                self._channel.eof_received()
        except ssl.SSLError as error:
            self._end(error)
        except BaseException:
            self.abort()  # as the event loop does after an error in buffer_updated
            raise
        self._flush()  # a part of the handshake, or an alert
        if not (cipher.share or self._waiting or raw is None or raw.is_closing()) and cipher.has_input:
            self._waiting = True
            raw.pause_reading()
            _go_on_later(self, self._loop, budget)

    def _flush(self) -> None:
        data = self._cipher.pop_output()
        if data and self._raw is not None:
            self._raw.write(data)

    def _end(self, error: OSError | None = None) -> None:
        """Close after everything written has been sent, and the alert with the fault of TLS."""
        self._closing = True
        self._error = error
        if error is None:
            self._cipher.finish()
        self._flush()
        if self._raw is not None:
            self._raw.close()

    # The transport of the channel

    def write(self, data: Buffer) -> None:
        """Encrypt and send bytes; during the handshake, after it."""
        if self._closing:
            return
        if not self._established:
            self._unsent.append(bytes(data))
            return
        self._cipher.encrypt(data)
        self._flush()

    def close(self) -> None:
        """Close after everything written has been sent, which may wait for the end of the handshake."""
        if self._closing:
            return
        self._closing = True
        if self._established:
            self._end()
        elif not self._unsent:
            self.abort()

    def abort(self) -> None:
        """Close at once."""
        self._closing = True
        if self._raw is not None:
            self._raw.abort()

    def is_closing(self) -> bool:
        """Return whether it is closed, or about to be."""
        return self._closing or self._raw is None or self._raw.is_closing()

    def pause_reading(self) -> None:
        """Decrypt no more until `resume_reading`."""
        self._paused = True
        if self._raw is not None:
            self._raw.pause_reading()

    def resume_reading(self) -> None:
        """Go on, in the next loop turn, with what has been received."""
        self._paused = False
        if not self._waiting and self._raw is not None and not self._closing:
            self._raw.resume_reading()
            self._loop.call_soon(self._process)

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Set when the socket's transport pauses the channel; bytes count as encrypted."""
        if self._raw is not None:
            self._raw.set_write_buffer_limits(high, low)

    def get_write_buffer_size(self) -> int:
        """Return how many encrypted bytes wait until the peer reads them."""
        return 0 if self._raw is None else self._raw.get_write_buffer_size()

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        """Return what the socket's transport knows; "ssl_object" is None until the handshake is over."""
        if name == "ssl_object":
            return self._cipher.tls if self._established else default
        if name == "sslcontext":
            return self._cipher.tls.context
        if name == "tls_bytes":
            return self._cipher.held_bytes
        return default if self._raw is None else self._raw.get_extra_info(name, default)
