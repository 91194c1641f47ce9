"""Large bodies of answers in pieces, so that one client takes little memory and time at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.web import limits

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator


async def pieces(data: bytes) -> AsyncGenerator[memoryview]:
    """Return parts of `PIECE_BYTES`.

    Args:
        data: What is sent.
    """
    for start in range(0, len(data), limits.PIECE_BYTES):
        yield memoryview(data)[start : start + limits.PIECE_BYTES]
