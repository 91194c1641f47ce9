"""Where the messages of a batch end: offsets as little-endian u32 (docs/protocol.md §6.1)."""

from __future__ import annotations

import operator
import sys
from array import array
from typing import Final

from proto import limits
from proto.errors import ErrorCode, ProtocolError

_LITTLE_ENDIAN: Final = sys.byteorder == "little"


def ends_to_bytes(ends: array[int]) -> bytes:
    """Return message end offsets (array typecode "I") as little-endian u32."""
    if not _LITTLE_ENDIAN:  # pragma: no cover
        ends = ends[:]
        ends.byteswap()
    return ends.tobytes()


def ends_from_bytes(data: bytes) -> array[int]:
    """Return little-endian u32 end offsets as an array."""
    ends = array("I", data)
    if not _LITTLE_ENDIAN:  # pragma: no cover
        ends.byteswap()
    return ends


def check_ends(name: str, count: int, ends: bytes | None, body_bytes: int) -> None:
    """Check that the ends of a batch rise to the end of its messages: splitting it relies on that.

    Args:
        name: The frame, for the error.
        count: How many messages it says it has.
        ends: Where they end; None for a single message.
        body_bytes: The size of all messages.

    Raises:
        ProtocolError: They do not.
    """
    if count == 1:
        if ends is not None or body_bytes == 0:
            raise _malformed(f"{name}: a single message has a body and no ends")
        return
    if ends is None or len(ends) != 4 * count:
        raise _malformed(f"{name}: {count} messages need {4 * count} bytes of ends")
    offsets = ends_from_bytes(ends).tolist()
    if offsets[0] == 0 or offsets[-1] != body_bytes or not all(map(operator.lt, offsets, offsets[1:])):
        raise _malformed(f"{name}: the ends do not rise to the end of the messages")


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text[: limits.MAX_ERROR_TEXT])
