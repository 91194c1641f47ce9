"""Bytes in, frames out: the receiving half of a connection, without I/O.

The owner of a socket reads into `buffer()`, reports the number of bytes with `received()`, and calls
`next_frame()` until it returns None. The receiver reassembles fragments and checks every frame against the
state of the session.

Connections that never read at the same time may share one scratch buffer: when `next_frame()` has returned
None, the scratch buffer is empty, so an idle connection owns no buffer at all. An owner that stops earlier
calls `keep()`, which moves the unprocessed bytes into a buffer of their own. A large frame is received into
its own buffer, which becomes the frame.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import BIN_32, decode
from proto.wire.codes import Op
from proto.wire.fragments import ByteTotal

if TYPE_CHECKING:
    from proto.wire.codec import Decoder
    from proto.wire.fragments import Reassembler
    from proto.wire.frames import Buffer, Frame
    from proto.wire.session import Session

SCRATCH_BYTES: Final = 2 * (limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES)
"""The required size of a scratch buffer."""

_OWN_BYTES: Final = 96 * 1024
"""Frames from this size on get their own buffer. Copying a smaller one out of the scratch buffer costs less
than a separate read."""

_CLAIM_RATIO: Final = 8
"""A large frame gets its own buffer when 1/8 of it has been received, so that an announced size alone
allocates nothing."""

_BEHIND_BYTES: Final = 4 * 1024
"""Space after a large frame in its buffer, since the read that completes it may also get later bytes."""

_REPEATED: Final = frozenset({Op.ACCEPTED, Op.MATCHED, Op.UNDECLARE})
"""Frames that are often the same, whatever the link."""

_TINY: Final = range(limits.PREFIX_BYTES + 2, limits.PREFIX_BYTES + 12)
"""Encoded sizes of such frames. Longer ones are not cached, so that a peer cannot fill the cache with
bytes."""

PARTS: Final = frozenset({frames.Fragment, frames.Abort})
"""Frames about parts of others, which the receiver itself handles."""

_TLS_HANDSHAKE: Final = 0x16
"""First byte of a connection with TLS."""

_FRAGMENTABLE: Final = (frames.Batch, frames.Replay, frames.Request, frames.Reply)


@lru_cache(maxsize=1000)
def _decode_repeated(raw: bytes) -> Frame:
    return decode(raw)


class Receiver:
    """Splits the bytes of one connection into frames.

    Args:
        session: Decides which frames the peer may send and how large they may be.
        scratch: `SCRATCH_BYTES` bytes to read into, possibly shared with other receivers.
        decoder: Decodes the frames, possibly shared with other receivers.
        reassembler: Joins the peer's fragments.
        total: Counts the buffers of several receivers; None for a count of its own.

    Attributes:
        has_unprocessed: Whether there are received bytes for `next_frame` to look at; if not, it returns
            None.
        held_bytes: Size of the buffers that `keep` and incomplete frames have; counted in `total`.
    """

    __slots__ = (
        "_decoder",
        "_end",
        "_filled",
        "_own",
        "_reassembler",
        "_rest",
        "_scratch",
        "_session",
        "_source",
        "_start",
        "_total",
        "has_unprocessed",
        "held_bytes",
    )

    def __init__(
        self,
        session: Session,
        scratch: memoryview,
        decoder: Decoder,
        reassembler: Reassembler,
        total: ByteTotal | None = None,
    ) -> None:
        self._session = session
        self._scratch = scratch
        self._decoder = decoder
        self._reassembler = reassembler
        self._total = total or ByteTotal()
        self.held_bytes = 0
        self._source = scratch
        """Where the frames are read from: the scratch buffer, or a buffer made by `keep`."""
        self._start = self._end = 0
        """The unprocessed part of it."""
        self._rest = b""
        """The received start of an incomplete frame."""
        self._own: memoryview | None = None
        """The buffer of a large frame that is being received."""
        self._filled = 0
        """Bytes received into it."""
        self.has_unprocessed = False

    def buffer(self) -> memoryview:
        """Return a buffer of at least one byte for the next read, behind the start of an incomplete frame."""
        if self._own is not None:
            return self._own[self._filled :]
        if not self._rest:
            return self._scratch
        start = len(self._rest)
        self._scratch[:start] = self._rest
        return self._scratch[start:]

    def received(self, nbytes: int) -> None:
        """Report that `nbytes` bytes have been read into the last `buffer()`. Not while bytes are kept."""
        self._start = 0
        if self._own is None:
            self._end = end = len(self._rest) + nbytes
            self._rest = b""
            self.has_unprocessed = end > 0
        else:
            self._end = 0
            self._filled += nbytes
            self.has_unprocessed = self._filled >= len(self._own) - _BEHIND_BYTES

    @property
    def kept_bytes(self) -> int:
        """Size of the buffer made by `keep`; 0 without one."""
        return 0 if self._source is self._scratch else len(self._source)

    def keep(self) -> None:
        """Keep the unprocessed bytes, so that others may use the scratch buffer before the next frame."""
        if self._source is self._scratch:
            self._source = memoryview(bytes(self._scratch[self._start : self._end]))
            self._start, self._end = 0, len(self._source)
            self._hold(len(self._source) + (0 if self._own is None else len(self._own)))

    def _hold(self, size: int) -> None:
        self._total.bytes += size - self.held_bytes
        self.held_bytes = size

    def discard(self) -> None:
        """Forget the received bytes, as the connection has ended."""
        self._source, self._start, self._end = self._scratch, 0, 0
        self._rest, self._own = b"", None
        self.has_unprocessed = False
        self._hold(0)

    def next_frame(self) -> Frame | None:
        """Return the next frame that the session allows, or None if more bytes are needed.

        The last fragment of a frame is replaced by that frame. The other frames in `PARTS` need no handling;
        they are returned so that the owner can count them.

        Raises:
            ProtocolError: The bytes are not a frame, or the session does not allow it now. The receiver is
                unusable afterwards.
        """
        raw = self._next_raw()
        if raw is None:
            return None
        # Acknowledgements come in thousands when a program starts; most are equal to an earlier one.
        if len(raw) in _TINY and raw[limits.PREFIX_BYTES + 1] in _REPEATED:
            frame = _decode_repeated(bytes(raw))
        else:
            frame = self._decoder.decode_content(raw)
        self._session.received(frame)
        return frame if type(frame) not in PARTS else self._reassemble(frame)

    def _next_raw(self) -> Buffer | None:
        """Return the next encoded frame.

        The size limit is looked up for each frame, because the first one of a read may open the session.
        """
        if not self.has_unprocessed:
            return None
        if self._own is not None:
            return self._finish_own(self._own)
        start, end, source = self._start, self._end, self._source
        if source[start] != BIN_32:
            # A client with callboards:// at a port without TLS is the usual mistake, so it gets a hint.
            is_tls = source[start] == _TLS_HANDSHAKE
            hint = ", as TLS does; a broker needs --tls-cert for that" if is_tls else ""
            raise ProtocolError(ErrorCode.MALFORMED, f"not a frame: starts with {source[start]:#04x}{hint}")
        stop = start + limits.PREFIX_BYTES
        if stop <= end:
            size = int.from_bytes(source[start + 1 : stop], "big")
            # Before its bytes are waited for: a stranger must not make the broker wait for 256 KiB.
            if size > limits.MAX_HELLO_BYTES:
                self._check_size(size)
            stop += size
        if stop > end:
            self._keep(start, end, stop)
            return None
        if stop < end:
            self._start = stop
        else:
            self.has_unprocessed = False
            self._source = self._scratch
            if self.held_bytes:
                self._hold(0)
        return bytes(source[start:stop])

    def _check_size(self, size: int) -> None:
        most = limits.MAX_FRAME_BYTES if self._session.is_open else limits.MAX_HELLO_BYTES
        if size > most:
            raise ProtocolError(ErrorCode.TOO_LARGE, f"a frame of {size} bytes is over the limit of {most}")

    def _finish_own(self, own: memoryview) -> Buffer:
        """Return the large frame, which is complete, and copy the bytes after it to the scratch buffer."""
        size = len(own) - _BEHIND_BYTES
        behind = self._filled - size
        self._own = None
        self.has_unprocessed = behind > 0
        self._hold(0)
        self._source = self._scratch
        self._source[:behind] = own[size : self._filled]
        self._start, self._end = 0, behind
        return own[:size].toreadonly()  # like bytes: several readers may share it

    def _keep(self, start: int, end: int, stop: int) -> None:
        """Keep the start of an incomplete frame of `stop - start` bytes."""
        source, self._source = self._source, self._scratch
        self._start = self._end = 0
        self.has_unprocessed = False
        size, here = stop - start, end - start
        # Copied, because the scratch buffer belongs to the next connection that reads.
        if size < _OWN_BYTES or here < size // _CLAIM_RATIO:
            self._rest = bytes(source[start:end])
            self._hold(here)
            return
        own = self._own = memoryview(bytearray(size + _BEHIND_BYTES))
        own[:here] = source[start:end]
        self._filled = here
        self._hold(len(own))

    def _reassemble(self, frame: Frame) -> Frame:
        """Handle a FRAGMENT or an ABORT; return the frame that it completes, or else itself."""
        if not isinstance(frame, frames.Fragment):
            assert isinstance(frame, frames.Abort)
            self._reassembler.abort(frame)
            return frame
        raw = self._reassembler.add(frame)
        if raw is None:
            return frame
        whole = self._decoder.decode(memoryview(raw).toreadonly())
        # Control frames must be small: they overtake messages, and a large one would delay other links.
        if not isinstance(whole, _FRAGMENTABLE):
            name = type(whole).__name__.upper()
            raise ProtocolError(ErrorCode.UNEXPECTED, f"{name} must not travel in fragments")
        self._session.received(whole)
        return whole
