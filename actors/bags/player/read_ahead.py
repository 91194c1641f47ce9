"""Reads messages in a thread before they are due, up to a limit."""

from __future__ import annotations

import asyncio
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.bags.errors import BagError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.bags.player.bag_source import BagSource
    from actors.bags.player.played_topic import DueMessage

T = TypeVar("T")

BATCH: Final = 100
"""Messages that the thread reads before it hands them over: some milliseconds of work."""
MAX_BYTES: Final = 64 * 1024 * 1024
"""Limit for the memory of waiting messages, whatever their number: a second of a camera."""


class ReadAhead:
    """A queue of messages that a thread fills.

    All methods are called on the event loop.

    Args:
        max_messages: Limit for the number of waiting messages.
        on_changed: Called when messages were added, or when the end was reached.

    Attributes:
        is_ended: Whether no messages will follow those in the queue.
    """

    def __init__(self, max_messages: int, on_changed: Callable[[], object]) -> None:
        self._max_messages = max_messages
        self._on_changed = on_changed
        self._pool = ThreadPoolExecutor(1, "bag-player")
        self._queue: deque[DueMessage] = deque()
        self._bytes = 0
        self._room = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._source: BagSource | None = None
        self._messages: Generator[DueMessage] | None = None
        """Used by the thread only."""
        self._thread_error: Exception | None = None
        """Set by the thread: the error after the newest batch."""
        self._error: Exception | None = None
        self.is_ended = False

    async def call(self, function: Callable[..., T], *arguments: Any) -> T:
        """Call a function in the thread; return its result."""
        return await asyncio.get_running_loop().run_in_executor(self._pool, function, *arguments)

    def begin(self, source: BagSource, from_ns: int | None) -> None:
        """Discard the queue, and read from a time of the bag on.

        Args:
            source: The bag to read.
            from_ns: The time of the bag; None for its beginning.
        """
        self._source = source
        if self._task is not None:
            self._task.cancel()
        self._queue.clear()
        self._bytes = 0
        self._error, self.is_ended = None, False
        self._task = asyncio.create_task(self._fill(source, from_ns))

    async def _fill(self, source: BagSource, from_ns: int | None) -> None:
        try:
            await self.call(self._open, source, from_ns)
            while not self.is_ended:
                batch = await self.call(self._read, min(BATCH, self._max_messages))
                if self._thread_error is not None:
                    # The messages before the damage are played first.
                    self._error = self._thread_error
                self._queue.extend(batch)
                self._bytes += sum(len(each.data) for each in batch)
                self.is_ended = not batch or self._error is not None
                self._on_changed()
                while not self._has_room:
                    self._room.clear()
                    await self._room.wait()
        except Exception as error:  # noqa: BLE001 - `first` raises it: the player would wait for ever otherwise
            self._error, self.is_ended = error, True
            self._on_changed()

    def _open(self, source: BagSource, from_ns: int | None) -> None:
        if self._messages is not None:
            self._messages.close()
        self._messages = source.messages(from_ns)
        self._thread_error = None

    def _read(self, count: int) -> list[DueMessage]:
        assert self._messages is not None
        found: list[DueMessage] = []
        size = 0
        try:
            for message in islice(self._messages, count):
                found.append(message)
                size += len(message.data)
                if size > MAX_BYTES // 8:
                    break
        except (CallboardError, OSError) as error:
            self._thread_error = error
        return found

    @property
    def _has_room(self) -> bool:
        # Room for a batch, or half of a small queue, so that the thread does not wake up for each message.
        limit = max(self._max_messages - BATCH, self._max_messages // 2)
        return len(self._queue) <= limit and self._bytes <= MAX_BYTES // 2

    @property
    def first(self) -> DueMessage | None:
        """The next message; None if none has been read yet, or at the end.

        Raises:
            BagError: The bag is damaged here.
        """
        if self._queue:
            return self._queue[0]
        if self._error is not None:
            if isinstance(self._error, OSError):
                raise BagError(f"The bag cannot be read: {self._error}") from self._error
            raise self._error
        return None

    def pop(self) -> DueMessage:
        """Remove and return the next message."""
        message = self._queue.popleft()
        self._bytes -= len(message.data)
        if self._has_room:
            self._room.set()
        return message

    async def close(self) -> None:
        """Stop reading, and close the source."""
        if self._task is not None:
            self._task.cancel()
        try:
            if self._source is not None:
                await asyncio.shield(self.call(self._close, self._source))
        finally:
            self._pool.shutdown(wait=False)

    def _close(self, source: BagSource) -> None:
        if self._messages is not None:
            self._messages.close()
        source.close()
