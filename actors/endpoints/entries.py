"""Collects requests or replies over a loop turn, so that many are sent in one frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from proto import limits
from proto.wire.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from actors.session.link import FlushSource, Link

ENTRY_OVERHEAD_BYTES: Final = 24
"""The most bytes that an entry needs in addition to its body."""

TIMED_OUT: Final = "timed_out"
"""Attribute of a reply with status CANCELLED: a deadline has passed behind the server, a forwarder."""

E = TypeVar("E", RequestEntry, ReplyEntry)


class EntryBatch(Generic[E]):
    """The entries of the next frame, within `limits.CALLS_FLUSH_BYTES` and `CALLS_FLUSH_COUNT`.

    A single entry may be larger than that; it is then sent alone. So a large request or reply can be dropped,
    or refused by the broker, without costing its neighbours.
    """

    __slots__ = ("_bytes", "_entries")

    def __init__(self) -> None:
        self._entries: list[E] = []
        self._bytes = 0

    def send(self, entry: E, source: FlushSource, link: Link) -> None:
        """Collect an entry of `source`; its frame is sent when it is full, or at the end of the loop turn."""
        size = len(entry.body) + ENTRY_OVERHEAD_BYTES
        if self._bytes + size > limits.CALLS_FLUSH_BYTES:
            source.flush_turn()
        entries = self._entries  # not before: flush_turn replaces them
        if not entries:  # the link knows of the others' frame already
            link.flush_later(source)
        entries.append(entry)
        self._bytes += size
        if len(entries) >= limits.CALLS_FLUSH_COUNT:
            source.flush_turn()
            link.flush()

    def __bool__(self) -> bool:
        return bool(self._entries)

    def withdraw(self, call: int) -> bool:
        """Remove a call's entry; return False if it has been sent."""
        for index, entry in enumerate(self._entries):
            if entry.call == call:
                del self._entries[index]
                self._bytes -= len(entry.body) + ENTRY_OVERHEAD_BYTES
                return True
        return False

    def peek_all(self) -> tuple[E, ...]:
        """Return the collected entries."""
        return tuple(self._entries)

    def pop_all(self) -> tuple[E, ...]:
        """Remove and return the collected entries."""
        entries, self._entries = tuple(self._entries), []
        self._bytes = 0
        return entries


def remaining_ms(seconds: float) -> int | None:
    """Return the time that a call has left as REQUEST carries it; None if the call has no deadline."""
    return None if seconds == math.inf else math.ceil(min(seconds * 1000, limits.MAX_U32))
