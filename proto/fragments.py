"""Large frames in pieces: cut on one side, put together in one buffer on the other.

The buffer grows with what has come, not with what was announced: a total costs the sender nothing.
"""

from __future__ import annotations

from proto import limits
from proto.codec import encode_head
from proto.errors import ErrorCode, ProtocolError
from proto.frames import Abort, Buffer, Fragment


def is_large(raw: Buffer) -> bool:
    """Tell whether an encoded frame must travel as fragments."""
    return len(raw) > limits.MAX_FRAME_BYTES + limits.PREFIX_BYTES


class Transfer:
    """A large frame on its way out."""

    __slots__ = ("_offset", "_raw", "id")

    def __init__(self, transfer_id: int, raw: Buffer) -> None:
        self.id = transfer_id
        self._raw = memoryview(raw)
        self._offset = 0

    def next(self) -> tuple[bytes, memoryview, bool]:
        """Return the next FRAGMENT frame, its payload apart and not copied, and whether it was the last."""
        start, total = self._offset, len(self._raw)
        stop = min(start + limits.FRAGMENT_BYTES, total)
        self._offset = stop
        payload = self._raw[start:stop]
        piece = Fragment(self.id, total if start == 0 else None, stop < total, payload)
        return encode_head(piece), payload, stop == total


class Reassembler:
    """Puts a peer's fragments together.

    Bounded: `limits.MAX_TRANSFERS` frames at a time, each at most `max_bytes`.
    """

    __slots__ = ("_max_bytes", "_open")

    def __init__(self, max_bytes: int = limits.MAX_MESSAGE_BYTES) -> None:
        self._max_bytes = max_bytes
        self._open: dict[int, tuple[bytearray, int]] = {}
        """By transfer id: what has come, and the total."""

    def add(self, fragment: Fragment) -> bytearray | None:
        """Take one piece; return the whole encoded frame when it was the last.

        Raises:
            ProtocolError: Too large, too many at a time, or pieces that do not fit together.
        """
        found = self._open.pop(fragment.transfer, None)
        if (found is None) == (fragment.total is None):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: exactly the first piece has the total size")
        if found is None:
            assert fragment.total is not None
            self._check_start(fragment.total)
            found = bytearray(), fragment.total
        buffer, total = found
        end = len(buffer) + len(fragment.payload)
        if not fragment.payload or end > total or fragment.more == (end == total):
            raise ProtocolError(ErrorCode.MALFORMED, "FRAGMENT: the pieces do not add up to the total size")
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
        """Forget a transfer; an unknown one is ignored (its last piece may have crossed the ABORT)."""
        self._open.pop(abort.transfer, None)
