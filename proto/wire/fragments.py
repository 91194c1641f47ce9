"""Large frames in fragments: split by the sender, reassembled by the receiver (docs/protocol.md §6.8).

The memory of a reassembly buffer grows with the bytes received, not with the total that a peer announces.
What a receiver holds of incomplete frames is limited for each link, for all links together, and in time.
"""

from __future__ import annotations

import mmap
import sys
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire.codec import encode_head
from proto.wire.codes import Op
from proto.wire.frames import Abort, Buffer, Fragment

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.wire.references import References

_OPCODE_AT: Final = limits.PREFIX_BYTES + 1
_BATCH: Final = bytes([Op.BATCH])

MAP_ABOVE_BYTES: Final = 32 * 1024 * 1024
"""Buffers of larger frames get their full size at once, with mmap: each growth of a bytearray may copy it,
which takes tens of milliseconds in all. The system provides memory only for pages that are written to.
(malloc maps blocks of this size, too, but reuses smaller ones, which is much faster.)"""

MAP_RATIO: Final = 8
"""A buffer is mapped when 1/8 of the frame has arrived, so that the number of mappings is limited, too."""

_PRIVATE: Final = {} if sys.platform == "win32" else {"flags": mmap.MAP_PRIVATE}
"""Arguments of mmap, which otherwise shares the memory with child processes."""


def is_large(raw: Buffer) -> bool:
    """Return whether an encoded frame must travel as fragments."""
    return len(raw) > limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES  # not `is_large_size`: for each frame


def is_large_size(frame_bytes: int) -> bool:
    """Return whether an encoded frame of this size must travel as fragments."""
    return frame_bytes > limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES


class Transfer:
    """A large frame that is being sent in fragments.

    Args:
        transfer_id: Its id.
        raw: The encoded frame.
        head: The bytes before `raw` in the frame, if the two are not joined.
        shared: Whether `raw` is shared memory, which must not be left in the buffer of a transport.
    """

    __slots__ = ("_head", "_offset", "_raw", "_shared", "id", "size")

    def __init__(self, transfer_id: int, raw: Buffer, head: bytes = b"", *, shared: bool = False) -> None:
        self.id = transfer_id
        self._shared = shared
        self._raw = memoryview(raw)
        self.size = len(head) + len(raw)
        self._head = head
        self._offset = 0

    def next(self) -> tuple[bytes, Buffer, bool]:
        """Return the head of the next FRAGMENT frame, its payload, and whether it is the last."""
        start, end, head = self._offset, len(self._raw), self._head
        total = None if start else self.size
        stop = min(start + limits.FRAGMENT_BYTES - len(head), end)
        payload: Buffer = self._raw[start:stop]
        if head:
            payload, self._head = b"".join((head, payload)), b""
        elif self._shared:  # its slot may be used again before the transport has sent it
            payload = bytes(payload)
        self._offset = stop
        return encode_head(Fragment(self.id, total, stop < end, payload)), payload, stop == end


class Transfers:
    """The open transfers of one link in one direction: their ids and their number.

    Attributes:
        full: Whether `limits.MAX_TRANSFERS` are open.
        max_bytes: Size of the open transfers together, if there is more than one; set by the owner.
        references: Sends messages in shared memory by reference; None if the link has none. Set by the owner.
    """

    __slots__ = ("_bytes", "_next_id", "_open", "full", "max_bytes", "references")

    def __init__(self) -> None:
        self.references: References | None = None
        self.full = False
        self.max_bytes = sys.maxsize
        self._next_id = 0
        self._open: set[int] = set()
        self._bytes = 0

    def start(self, raw: Buffer, head: bytes = b"", *, shared: bool = False) -> Transfer | None:
        """Open a transfer of an encoded frame, possibly without its head, or (`shared`) in shared memory.

        Returns:
            None if `full`, or if the frame would exceed `max_bytes`.
        """
        size = len(head) + len(raw)
        if self.full or (self._open and self._bytes + size > self.max_bytes):
            return None
        self._bytes += size
        self._next_id = (self._next_id + 1) & limits.MAX_U32
        # After 2^32 transfers an id comes again; one that is still open must not be taken twice.
        while self._next_id in self._open:
            self._next_id = (self._next_id + 1) & limits.MAX_U32
        self._open.add(self._next_id)
        self.full = len(self._open) >= limits.MAX_TRANSFERS
        return Transfer(self._next_id, raw, head, shared=shared)

    def end(self, transfer: Transfer) -> None:
        """Remove a transfer that is finished or aborted."""
        self._open.discard(transfer.id)
        self._bytes -= transfer.size
        self.full = False


class WholeFrame(Transfer):
    """A large frame that is sent at once."""

    __slots__ = ("_whole",)

    def __init__(self, raw: Buffer, head: bytes) -> None:
        super().__init__(0, raw, head)
        self._whole = raw

    def next(self) -> tuple[bytes, Buffer, bool]:
        """Return the two parts of the frame, of which the first may be empty."""
        return self._head, self._whole, True


class WholeFrames(Transfers):
    """Large frames for a transport that takes them whole: none is open, or split into FRAGMENT frames."""

    __slots__ = ()

    def start(self, raw: Buffer, head: bytes = b"", *, shared: bool = False) -> Transfer:  # noqa: ARG002
        """Return an encoded frame, possibly without its head, as a transfer."""
        return WholeFrame(raw, head)

    def end(self, transfer: Transfer) -> None:
        """Do nothing: the frame has been sent."""


class ByteTotal:
    """Bytes that several parts of a program hold together."""

    __slots__ = ("bytes",)

    def __init__(self) -> None:
        self.bytes = 0


class ReassemblyTotal(ByteTotal):
    """Bytes of incomplete frames that several receivers hold together.

    Args:
        max_bytes: The limit, which the owner enforces.
        on_refused: Called for each frame discarded.

    Attributes:
        bytes: Bytes held now.
        refusing: Whether to discard the parts of large BATCH frames that begin now.
        refused: Frames discarded.
    """

    __slots__ = ("_on_refused", "max_bytes", "refused", "refusing")

    def __init__(self, max_bytes: int = sys.maxsize, on_refused: Callable[[], None] | None = None) -> None:
        super().__init__()
        self._on_refused = on_refused
        self.max_bytes = max_bytes
        self.refusing = False
        self.refused = 0

    def refuse(self) -> None:
        """Count a frame that is discarded."""
        self.refused += 1
        if self._on_refused is not None:
            self._on_refused()


class _Partial:
    """An incomplete frame, of which `size` bytes have arrived."""

    __slots__ = ("buffer", "checked_bytes", "grown_at", "size", "total")

    def __init__(self, total: int) -> None:
        self.buffer: bytearray | memoryview = bytearray()
        self.size = 0
        self.total = total
        self.checked_bytes = -1
        """The size at the last check."""
        self.grown_at = 0.0
        """Time of the last check that found it larger than before."""

    def append(self, payload: Buffer) -> None:
        """Add the next bytes."""
        start, self.size = self.size, self.size + len(payload)
        buffer = self.buffer
        if isinstance(buffer, bytearray):
            if self.total <= MAP_ABOVE_BYTES or self.size < self.total // MAP_RATIO:
                buffer += payload
                return
            self.buffer = memoryview(mmap.mmap(-1, self.total, **_PRIVATE))
            self.buffer[:start] = buffer
        self.buffer[start : self.size] = payload


class Reassembler:
    """Joins a peer's fragments: up to `limits.MAX_TRANSFERS` frames at a time.

    Args:
        max_bytes: Size of one frame.
        max_held_bytes: Bytes of incomplete frames.
        total: Counts the bytes of several reassemblers.

    Attributes:
        held_bytes: Bytes of incomplete frames.
    """

    __slots__ = ("_max_bytes", "_max_held_bytes", "_open", "_refused", "_total", "held_bytes")

    def __init__(
        self,
        max_bytes: int = limits.MAX_MESSAGE_BYTES,
        max_held_bytes: int = sys.maxsize,
        total: ReassemblyTotal | None = None,
    ) -> None:
        self._max_bytes = max_bytes
        self._max_held_bytes = max_held_bytes
        self._total = total or ReassemblyTotal()
        self._open: dict[int, _Partial] = {}
        self._refused: set[int] = set()
        """Transfers whose fragments are discarded."""
        self.held_bytes = 0

    def add(self, fragment: Fragment) -> Buffer | None:
        """Add one fragment; return the whole encoded frame if it was the last one and is not refused.

        Raises:
            ProtocolError: The frame is too large, too many transfers are open or bytes are held, or the
                fragments are inconsistent.
        """
        if self._refused and fragment.transfer in self._refused and fragment.total is None:
            if not fragment.more:
                self._refused.discard(fragment.transfer)
            return None
        partial = self._open.get(fragment.transfer)
        if (partial is None) == (fragment.total is None):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: exactly the first one has the total size")
        if partial is None:
            assert fragment.total is not None
            # Before anything is allocated for it.
            self._check_start(fragment.total)
            if (
                self._total.refusing
                and fragment.more
                and fragment.payload[_OPCODE_AT : _OPCODE_AT + 1] in {_BATCH, b""}
            ):
                self._total.refuse()
                self._refused.add(fragment.transfer)
                return None
            partial = self._open[fragment.transfer] = _Partial(fragment.total)
        size = len(fragment.payload)
        end = partial.size + size
        if not size or end > partial.total or fragment.more == (end == partial.total):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: they do not add up to the total size")
        partial.append(fragment.payload)
        self._count(size)
        if not fragment.more:
            del self._open[fragment.transfer]
            self._count(-end)
            return partial.buffer
        if self.held_bytes > self._max_held_bytes:
            text = f"more than {self._max_held_bytes} bytes of incomplete messages (max_reassembly_bytes)"
            raise ProtocolError(ErrorCode.LIMIT, text)
        return None

    def _count(self, size: int) -> None:
        self.held_bytes += size
        self._total.bytes += size

    def _check_start(self, total: int) -> None:
        if total > self._max_bytes:
            text = f"a message of {total} bytes is over the limit of {self._max_bytes}"
            raise ProtocolError(ErrorCode.TOO_LARGE, text)
        # Refused transfers count, too: otherwise a peer could make the set of their ids grow.
        if len(self._open) + len(self._refused) >= limits.MAX_TRANSFERS:
            text = f"more than {limits.MAX_TRANSFERS} fragmented frames at a time"
            raise ProtocolError(ErrorCode.LIMIT, text)

    def abort(self, abort: Abort) -> None:
        """Forget a transfer; ignore an unknown one, since its last fragment may have been sent already."""
        self._refused.discard(abort.transfer)
        partial = self._open.pop(abort.transfer, None)
        if partial is not None:
            self._count(-partial.size)

    def clear(self) -> None:
        """Forget all transfers, because the link ends."""
        self._open.clear()
        self._count(-self.held_bytes)

    def idle_sec(self, now: float) -> float:
        """Return the longest time for which an incomplete frame has not grown, as of the calls of this."""
        longest = 0.0
        for partial in self._open.values():
            if partial.checked_bytes != partial.size:
                partial.checked_bytes, partial.grown_at = partial.size, now
            longest = max(longest, now - partial.grown_at)
        return longest
