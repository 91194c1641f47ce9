"""Helpers for tests of outboxes: frames to put in, and functions to take frames out."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from proto.queues.batches import BatchBuilder
from proto.queues.publisher_queue import ReplaySource
from proto.wire.codec import encode
from proto.wire.frames import Batch, Replay, Request, RequestEntry

if TYPE_CHECKING:
    from collections.abc import Iterable

    from proto.queues.outbox import Outbox


def make_batch(first: int, parts: list[bytes], publisher: int = 1) -> Batch:
    """Build a batch of these messages."""
    builder = BatchBuilder(first)
    for part in parts:
        builder.add(part)
    return builder.build(publisher, 0)


def request(call: int, size: int) -> bytes:
    """Encode a request whose body has this size."""
    return encode(Request(1, (RequestEntry(call, None, None, bytes(size)),)))


def take_one(outbox: Outbox) -> bytes | None:
    """Take the next frame."""
    parts, size = outbox.pop_frames(1)
    assert size == sum(map(len, parts))
    return b"".join(parts) or None


def drain(outbox: Outbox) -> list[bytes]:
    """Take all frames that may be sent."""
    found: list[bytes] = []
    while (raw := take_one(outbox)) is not None:
        found.append(raw)
    return found


class Replays(ReplaySource):
    """A source of these latched messages."""

    def __init__(self, replays: Iterable[Replay]) -> None:
        self.left = deque(replays)

    def next_bytes(self) -> int:
        """Return the size of the next one."""
        return len(self.left[0].payload) if self.left else 0

    def pop(self) -> Replay:
        """Return the next one."""
        return self.left.popleft()
