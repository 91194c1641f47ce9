"""Entries of calls on their way out: collected over a loop turn, so that many travel in one frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Generic, TypeVar

from proto import limits
from proto.frames import ReplyEntry, RequestEntry

if TYPE_CHECKING:
    from actors.session.link import FlushSource, Link

ENTRY_OVERHEAD_BYTES: Final = 24
"""Room for an entry's fields beside its body."""

E = TypeVar("E", RequestEntry, ReplyEntry)


class EntryBatch(Generic[E]):
    """What goes into the next frame, within `limits.CALLS_FLUSH_BYTES` and `CALLS_FLUSH_COUNT`.

    A single entry may be larger than that; it then travels alone.
    """

    __slots__ = ("_bytes", "_entries")

    def __init__(self) -> None:
        self._entries: list[E] = []
        self._bytes = 0

    def has_room(self, entry: E) -> bool:
        """Tell whether the entry still belongs into this frame."""
        return self._bytes + len(entry.body) + ENTRY_OVERHEAD_BYTES <= limits.CALLS_FLUSH_BYTES

    def add(self, entry: E) -> bool:
        """Collect an entry; True if the frame should go now, without waiting for the end of the loop turn."""
        self._entries.append(entry)
        self._bytes += len(entry.body) + ENTRY_OVERHEAD_BYTES
        return len(self._entries) >= limits.CALLS_FLUSH_COUNT

    def send(self, entry: E, source: FlushSource, link: Link) -> None:
        """Collect an entry of `source`; its frame goes when it is full, or at the end of the loop turn."""
        if not self.has_room(entry):
            source.flush_turn()
        if self.add(entry):
            source.flush_turn()
            link.flush()
        else:
            link.flush_later(source)

    def take_back(self, call: int) -> bool:
        """Remove a call's entry; False if it is not here any more."""
        for index, entry in enumerate(self._entries):
            if entry.call == call:
                del self._entries[index]
                self._bytes -= len(entry.body) + ENTRY_OVERHEAD_BYTES
                return True
        return False

    def take(self) -> tuple[E, ...]:
        """Return what has been collected, and start anew."""
        entries, self._entries = tuple(self._entries), []
        self._bytes = 0
        return entries
