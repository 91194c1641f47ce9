"""Messages that wait for one client of a WebSocket, by channel: a slow client gets the newest. Pure.

Each channel has a queue and its turn, so that a flood on one neither delays nor displaces what others have. A
queue that is full drops its oldest message. But a latched topic may never say again what it has said, so the
newest message of each of its publishers is not dropped for other messages, up to `MAX_LATCHED_BYTES`.
"""

from __future__ import annotations

from collections import Counter, deque
from typing import TYPE_CHECKING, Final, Generic, NamedTuple, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable

K = TypeVar("K", bound="Hashable")
M = TypeVar("M")

MAX_MESSAGES: Final = 1000
"""Limit for the messages of one channel."""

MAX_CHANNEL_BYTES: Final = 1 << 20
"""Limit for their bytes, which a slow link sends in a second; one larger message may wait alone."""

MAX_LATCHED_BYTES: Final = 16 << 20
"""Limit for the bytes of a channel that are not dropped for other messages: the newest message of each
publisher of a latched topic. One larger message may wait alone."""

MAX_CLIENT_BYTES: Final = 64 << 20
"""Limit for the droppable bytes of all channels together."""

OVERHEAD_BYTES: Final = 256
"""Memory that a message takes beside its bytes."""


class _Waiting(NamedTuple, Generic[M]):
    """A message that waits.

    Attributes:
        message: The message.
        size: The memory that it takes, in bytes.
        source: The publisher if the topic is latched; else empty.
    """

    message: M
    size: int
    source: bytes


class _Channel(Generic[M]):
    """The queue of one channel.

    Args:
        limit: Messages at most.

    Attributes:
        limit: As given.
        droppable: Bytes of the messages that may be dropped for others.
    """

    __slots__ = ("_latched", "_newest", "_of_source", "_waiting", "droppable", "limit")

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._waiting: deque[_Waiting[M]] = deque()
        self._of_source: Counter[bytes] = Counter()
        """Messages of each publisher of a latched topic."""
        self._newest: dict[bytes, int] = {}
        """The size of the newest of each, the oldest first."""
        self.droppable = self._latched = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, waiting: _Waiting[M]) -> int:
        """Add a message; return how many are dropped for it."""
        _, size, source = waiting
        self._waiting.append(waiting)
        if source:
            former = self._newest.pop(source, 0)
            self.droppable += former
            self._latched += size - former
            self._newest[source] = size
            self._of_source[source] += 1
        else:
            self.droppable += size
        dropped = 0
        while (self.droppable > MAX_CHANNEL_BYTES or len(self) > self.limit) and self.drop(keep_last=True):
            dropped += 1
        while len(self) > 1 and (self._latched > MAX_LATCHED_BYTES or len(self) > self.limit):
            self._remove(0)
            dropped += 1
        return dropped

    def pop(self) -> M:
        """Return the oldest message, which no longer waits."""
        return self._remove(0)

    def drop(self, *, keep_last: bool) -> bool:
        """Drop the oldest message that may be dropped; return whether there is one.

        Args:
            keep_last: Whether the newest may not be, although the topic is not latched.
        """
        end = len(self) - keep_last
        for index, (_, _, source) in enumerate(self._waiting):
            if index < end and (not source or self._of_source[source] > 1):
                self._remove(index)
                return True
        return False

    def _remove(self, index: int) -> M:
        message, size, source = self._waiting[index]
        del self._waiting[index]
        if source and self._of_source[source] == 1:
            del self._of_source[source], self._newest[source]
            self._latched -= size
            return message
        if source:
            self._of_source[source] -= 1
        self.droppable -= size
        return message


class SendQueue(Generic[K, M]):
    """What waits for one client.

    Attributes:
        droppable: Bytes of the messages that may be dropped for others.
        drops: Messages dropped since it was last cleared, by channel.
    """

    def __init__(self) -> None:
        self._channels: dict[K, _Channel[M]] = {}
        self._ready: dict[K, None] = {}
        """Channels with messages, in the order of their turns."""
        self.droppable = 0
        self.drops: Counter[K] = Counter()

    def __bool__(self) -> bool:
        """Return whether a message waits."""
        return bool(self._ready)

    def open(self, key: K, limit: int = MAX_MESSAGES) -> None:
        """Open a channel.

        Args:
            key: Of the channel, which is not open.
            limit: Messages that wait at most.
        """
        self._channels[key] = _Channel(limit)

    def set_limit(self, key: K, limit: int) -> None:
        """Let another number of messages of a channel wait, from the next message on.

        Args:
            key: Of the channel.
            limit: Messages that wait at most.
        """
        self._channels[key].limit = limit

    def close(self, key: K) -> None:
        """Close a channel; its messages no longer wait."""
        self.droppable -= self._channels.pop(key).droppable
        self._ready.pop(key, None)
        del self.drops[key]

    def add(self, key: K, message: M, size: int, source: bytes = b"") -> None:
        """Queue a message; others are dropped if there are too many.

        Args:
            key: Of its channel.
            message: The message.
            size: Its bytes.
            source: The publisher if the topic is latched; else empty.
        """
        channel = self._channels[key]
        before = channel.droppable
        dropped = channel.add(_Waiting(message, size + OVERHEAD_BYTES, source))
        self.droppable += channel.droppable - before
        self._ready[key] = None
        if dropped:
            self.drops[key] += dropped
        if self.droppable > MAX_CLIENT_BYTES:
            self._make_room(key)

    def pop(self) -> tuple[K, M]:
        """Return the oldest message of the channel whose turn it is, which no longer waits.

        Raises:
            StopIteration: None waits.
        """
        key = next(iter(self._ready))
        channel = self._channels[key]
        before = channel.droppable
        message = channel.pop()
        self.droppable += channel.droppable - before
        del self._ready[key]
        if channel:
            self._ready[key] = None  # at the end
        return key, message

    def _make_room(self, added: K) -> None:
        """Drop messages of the largest channels; the newest of each is dropped after all others."""
        # An eighth more than needed: sorting costs as much as there are channels.
        wanted = MAX_CLIENT_BYTES * 7 // 8
        largest = sorted(self._channels.items(), key=lambda each: each[1].droppable, reverse=True)
        for keep_last in (True, False):
            for key, channel in largest:
                before = channel.droppable
                while self.droppable + channel.droppable - before > wanted and channel.drop(
                    keep_last=keep_last or key == added
                ):
                    self.drops[key] += 1
                self.droppable += channel.droppable - before
                if not channel:
                    self._ready.pop(key, None)
