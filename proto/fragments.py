"""Large frames in fragments: split by the sender, reassembled by the receiver (docs/protocol.md §6.8).

A reassembly buffer grows with the bytes received, not with the total that a peer announces.
"""

from __future__ import annotations

from proto import limits
from proto.codec import encode_head
from proto.errors import ErrorCode, ProtocolError
from proto.frames import Abort, Buffer, Fragment


def is_large(raw: Buffer) -> bool:
    """Return whether an encoded frame must travel as fragments."""
    return len(raw) > limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES


class Transfer:
    """A large frame that is being sent in fragments.

    Args:
        transfer_id: Its id.
        raw: The encoded frame.
        head: What precedes `raw` in the frame, if the two are not joined.
    """

    __slots__ = ("_head", "_offset", "_raw", "id")

    def __init__(self, transfer_id: int, raw: Buffer, head: bytes = b"") -> None:
        self.id = transfer_id
        self._raw = memoryview(raw)
        self._head = head
        self._offset = 0

    def next(self) -> tuple[bytes, Buffer, bool]:
        """Return the head of the next FRAGMENT frame, its payload, and whether it is the last."""
        start, end, head = self._offset, len(self._raw), self._head
        total = None if start else len(head) + end
        stop = min(start + limits.FRAGMENT_BYTES - len(head), end)
        payload: Buffer = self._raw[start:stop]
        if head:
            payload, self._head = b"".join((head, payload)), b""
        self._offset = stop
        return encode_head(Fragment(self.id, total, stop < end, payload)), payload, stop == end


class Transfers:
    """The open transfers of one link in one direction: their ids and their number.

    Attributes:
        full: Whether `limits.MAX_TRANSFERS` are open.
    """

    __slots__ = ("_next_id", "_open", "full")

    def __init__(self) -> None:
        self.full = False
        self._next_id = 0
        self._open: set[int] = set()

    def start(self, raw: Buffer, head: bytes = b"") -> Transfer | None:
        """Open a transfer of an encoded frame, possibly without its head; return None if `full`."""
        if self.full:
            return None
        self._next_id = (self._next_id + 1) & limits.MAX_U32
        while self._next_id in self._open:
            self._next_id = (self._next_id + 1) & limits.MAX_U32
        self._open.add(self._next_id)
        self.full = len(self._open) >= limits.MAX_TRANSFERS
        return Transfer(self._next_id, raw, head)

    def end(self, transfer: Transfer) -> None:
        """Remove a transfer that is finished or aborted."""
        self._open.discard(transfer.id)
        self.full = False


class Reassembler:
    """Joins a peer's fragments: up to `limits.MAX_TRANSFERS` frames at a time, of up to `max_bytes`."""

    __slots__ = ("_max_bytes", "_open")

    def __init__(self, max_bytes: int = limits.MAX_MESSAGE_BYTES) -> None:
        self._max_bytes = max_bytes
        self._open: dict[int, tuple[bytearray, int]] = {}
        """By transfer id: the bytes received so far, and the total size."""

    def add(self, fragment: Fragment) -> bytearray | None:
        """Add one fragment; return the whole encoded frame if it was the last one.

        Raises:
            ProtocolError: The frame is too large, too many transfers are open, or the fragments are
                inconsistent.
        """
        found = self._open.pop(fragment.transfer, None)
        if (found is None) == (fragment.total is None):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: exactly the first one has the total size")
        if found is None:
            assert fragment.total is not None
            self._check_start(fragment.total)
            found = bytearray(), fragment.total
        buffer, total = found
        end = len(buffer) + len(fragment.payload)
        if not fragment.payload or end > total or fragment.more == (end == total):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: they do not add up to the total size")
        buffer += fragment.payload
        if not fragment.more:
            return buffer
        self._open[fragment.transfer] = found
        return None

    def _check_start(self, total: int) -> None:
        if total > self._max_bytes:
            text = f"a message of {total} bytes is over the limit of {self._max_bytes}"
            raise ProtocolError(ErrorCode.TOO_LARGE, text)
        if len(self._open) >= limits.MAX_TRANSFERS:
            text = f"more than {limits.MAX_TRANSFERS} fragmented frames at a time"
            raise ProtocolError(ErrorCode.LIMIT, text)

    def abort(self, abort: Abort) -> None:
        """Forget a transfer; ignore an unknown one, since its last fragment may have been sent already."""
        self._open.pop(abort.transfer, None)
