"""Requests or replies that other threads than the loop's send, many in one frame.

The thread that completes a frame writes it itself, so that the other end begins with it while this thread
goes on. The loop sends what is left.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Final, Generic

from actors.endpoints.entries import ENTRY_OVERHEAD_BYTES, E
from actors.session.thread_channel import LOCK_SEC, MAX_BYTES, ThreadChannel
from proto.wire.codec import encode

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.entries import EntryBatch
    from actors.session.link import FlushSource, Link
    from proto.wire.frames import Frame

BURST: Final = 16
"""Entries of a frame that a thread writes. More are cheaper, but the other end begins later."""

MAX_ENTRY_BYTES: Final = MAX_BYTES - 64
"""The largest body that belongs here: with the frame around it a thread may write it."""


class ThreadEntries(Generic[E]):
    """The entries of one endpoint on their way out of other threads, in order.

    Args:
        link: The node's.
        outgoing: What the loop sends of this endpoint; nothing here overtakes it.
        source: Its owner, which the link flushes.
        frame: Makes a frame of entries.
    """

    __slots__ = ("_entries", "_frame", "_link", "_lock", "_outgoing", "_posted", "_source")

    def __init__(
        self,
        link: Link,
        outgoing: EntryBatch[E],
        source: FlushSource,
        frame: Callable[[tuple[E, ...]], Frame],
    ) -> None:
        self._link = link
        self._outgoing: EntryBatch[E] = outgoing
        self._source = source
        self._frame: Callable[[tuple[E, ...]], Frame] = frame
        self._entries: deque[tuple[object, E]] = deque()
        """With the channels that they are for: on another one, a number is that of another call."""
        self._lock = threading.Lock()
        """Held by whoever takes entries, until they are on their way."""
        self._posted = False
        """Whether the loop will look here."""

    def __bool__(self) -> bool:
        return bool(self._entries)

    def add(self, entry: E, channel: object, *, last: bool) -> None:
        """Send an entry; in any thread.

        Args:
            entry: The entry.
            channel: The channel of its session. On another one it is not sent.
            last: Whether no other is expected soon, so that it leaves at once.
        """
        self._entries.append((channel, entry))
        # After a frame that could not be written, not for each entry: the loop has been asked.
        due = last or len(self._entries) % BURST == 0
        if not (due and self._write()) and not self._posted:
            self._posted = True
            self._link.post(self.flush)

    def _write(self) -> bool:
        """Write frames in this thread; return False if the loop has to send the rest."""
        # Never waiting: it may be held by code that this thread has interrupted with a signal handler.
        if not self._lock.acquire(blocking=False):
            return False
        try:
            while self._entries:
                channel, entries = self._next()
                if channel is not self._link.channel:
                    continue
                # Nor does it overtake messages of this thread: who gets a reply finds them at the broker.
                behind = self._outgoing or self._link.is_behind
                frame = self._frame(tuple(entries))
                if behind or not isinstance(channel, ThreadChannel) or not channel.write_now(encode(frame)):
                    self._entries.extendleft((channel, entry) for entry in reversed(entries))
                    return False
        finally:
            self._lock.release()
        # Another thread may have added one meanwhile. It has not got the lock, and has asked the loop.
        return True

    def _next(self) -> tuple[object, list[E]]:
        """Remove and return the entries of the next frame, and their channel."""
        channel, entry = self._entries.popleft()
        entries = [entry]
        size = len(entry.body) + ENTRY_OVERHEAD_BYTES
        while self._entries and len(entries) < BURST:
            other, entry = self._entries[0]
            size += len(entry.body) + ENTRY_OVERHEAD_BYTES
            if other is not channel or size > MAX_ENTRY_BYTES:
                break
            self._entries.popleft()
            entries.append(entry)
        return channel, entries

    def flush(self) -> None:
        """Let the loop send what is here with its next frame; in the loop."""
        # Not forever, for the same reason.
        locked = self._lock.acquire(timeout=LOCK_SEC)
        self._posted = False  # first: what is added from here on asks again
        try:
            while self._entries:
                channel, entry = self._entries.popleft()
                if channel is self._link.channel:
                    self._outgoing.send(entry, self._source, self._link)
        finally:
            if locked:
                self._lock.release()

    def clear(self) -> None:
        """Discard what is here: its session has ended."""
        self._entries.clear()
