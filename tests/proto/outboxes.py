"""Helpers for tests of outboxes: frames to put in, and functions to take frames out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.batches import BatchBuilder
from proto.codec import encode
from proto.frames import Batch, Request, RequestEntry

if TYPE_CHECKING:
    from proto.outbox import Outbox


def make_batch(first: int, parts: list[bytes], publisher: int = 1) -> Batch:
    """Build a batch of these messages."""
    builder = BatchBuilder(first)
    for part in parts:
        builder.add(part)
    return builder.take(publisher, 0)


def request(call: int, size: int) -> bytes:
    """Encode a request whose body has this size."""
    return encode(Request(1, (RequestEntry(call, None, None, bytes(size)),)))


def take_one(outbox: Outbox) -> bytes | None:
    """Take the next frame."""
    parts, size = outbox.take(1)
    assert size == sum(map(len, parts))
    return b"".join(parts) or None


def drain(outbox: Outbox) -> list[bytes]:
    """Take all frames that may be sent."""
    found: list[bytes] = []
    while (raw := take_one(outbox)) is not None:
        found.append(raw)
    return found
