"""Requests that wait for a service's handler: bounded in number and in bytes, oldest first."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from proto.wire.frames import RequestEntry

MAX_QUEUED: Final = 200_000
"""Requests that wait for one service's handler; one more is refused as OVERLOADED."""

MAX_QUEUED_BYTES: Final = 256 * 1024 * 1024
"""The same in bytes; a single request may have any size."""


_NONE: Final[OrderedDict[int, RequestEntry]] = OrderedDict()
"""The entries of all queues that have had none."""


class RequestQueue:
    """The requests of one service that its handler has not begun.

    Args:
        max_requests: How many may wait.
        max_bytes: How many bytes of them may wait.

    Attributes:
        entries: By call, oldest first. Read-only: `put`, `pop` and `remove` keep `size` right.
        size: Their bytes.
    """

    __slots__ = ("_max_bytes", "_max_requests", "entries", "size")

    def __init__(self, max_requests: int = MAX_QUEUED, max_bytes: int = MAX_QUEUED_BYTES) -> None:
        self._max_requests, self._max_bytes = max_requests, max_bytes
        self.size = 0
        self.entries: OrderedDict[int, RequestEntry] = _NONE

    def put(self, entry: RequestEntry) -> str | None:
        """Queue a request; return the reason if there is no space."""
        if self.entries is _NONE:
            self.entries = OrderedDict()
        entries, size = self.entries, self.size + len(entry.body)
        if len(entries) >= self._max_requests:
            return f"{self._max_requests} requests wait already"
        if size > self._max_bytes and entries:
            return f"requests of {self.size} bytes wait already"
        entries[entry.call] = entry
        self.size = size
        return None

    def pop(self) -> RequestEntry:
        """Remove and return the oldest request. There must be one."""
        _, entry = self.entries.popitem(last=False)
        self.size -= len(entry.body)
        return entry

    def remove(self, call: int) -> bool:
        """Remove a request; return False if it does not wait here."""
        entry = self.entries.pop(call, None)
        if entry is None:
            return False
        self.size -= len(entry.body)
        return True

    def clear(self) -> None:
        """Remove all requests."""
        self.entries.clear()
        self.size = 0
