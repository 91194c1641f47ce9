"""Messages that leave out fields: one byte of a sequence asks for a whole message."""

from __future__ import annotations

from typing import Final

import msgpack

EMPTY_MAP: Final = b"\x80"


def starved(field: str, count: int, element: bytes = EMPTY_MAP) -> bytes:
    """Return a message with one field: a sequence of `count` equal elements, each an empty map."""
    return msgpack.packb({field: []})[:-1] + b"\xdd" + count.to_bytes(4, "big") + element * count
