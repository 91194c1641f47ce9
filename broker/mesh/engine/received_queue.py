"""The queue from Zenoh's threads, which receive, to the event loop, which handles within its read budget."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any, Final

import zenoh

from proto.aio.read_budget import SHARE_FRAMES, SHARE_SEC
from proto.errors import ProtocolError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from broker.mesh.engine.engine import Host
    from proto.aio.read_budget import ReadBudget


MAX_RECEIVED_BYTES: Final = 64 * 1024 * 1024
"""Bytes that may wait for the event loop. Beyond them Zenoh's thread waits, and so do the senders."""

MAX_NUMBERED_BYTES: Final = 2 * MAX_RECEIVED_BYTES
"""The same limit for numbered messages. It is higher, because losing one resets a session."""

MAX_BLOCK_SEC: Final = 1.0
"""How long Zenoh's thread waits before a message is dropped. It also keeps connections alive, so not
longer."""

OVERHEAD_BYTES: Final = 200
"""Memory of a queued item besides its payload."""


class ReceivedQueue:
    """Samples, queries and replies that wait for the event loop.

    Args:
        loop: The event loop.
        budget: Its read budget.
        host: Its `flush` is called after some have been handled.

    Attributes:
        dropped: Messages that had to be dropped because the event loop was too slow.
        malformed: Items that could not be decoded.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, budget: ReadBudget, host: Host) -> None:
        self._loop = loop
        self._budget = budget
        self._host = host
        self._items: deque[tuple[Callable[..., None], int, Any, int]] = deque()
        self._space = threading.Condition()
        self._bytes = self._handled_bytes = 0
        self._scheduled = False
        self._closed = False
        self.dropped = self.malformed = 0

    def callback(
        self, handler: Callable[..., None], domain: int, max_bytes: int | None = None
    ) -> zenoh.handlers.Callback[Any]:
        """Return a callback for Zenoh that lets the event loop call `handler(domain, item)`.

        It runs in Zenoh's network thread: with a thread for each key, keys would lose their common order.

        Args:
            handler: Handles a sample, query or reply. ProtocolError and ValueError mean that it is malformed.
            domain: Its first argument.
            max_bytes: Drop a sample if more bytes still wait after `MAX_BLOCK_SEC`; None to drop nothing.
        """

        def received(item: Any) -> None:
            self.put(handler, domain, item, max_bytes)

        return zenoh.handlers.Callback(received, indirect=False)

    def put(
        self,
        handler: Callable[..., None],
        domain: int,
        item: Any,
        max_bytes: int | None = None,
        size: int = 0,
    ) -> None:
        """Let the event loop call `handler(domain, item)`. Thread-safe; blocks only with `max_bytes`.

        Args:
            handler: As for `callback`.
            domain: Its first argument.
            item: Its second one.
            max_bytes: As for `callback`.
            size: Bytes of an item that is no sample.
        """
        size += OVERHEAD_BYTES
        if isinstance(item, zenoh.Sample):
            size += len(item.payload) + len(item.attachment or b"")
        with self._space:
            if max_bytes is not None and not self._wait_for_space(max_bytes):
                self.dropped += 1
                return
            self._bytes += size
        # Without the lock: appending to a deque is atomic.
        self._items.append((handler, domain, item, size))
        if not self._scheduled and not self._closed:
            self._scheduled = True
            self.in_loop(self._begin)

    def has_space(self, size: int) -> bool:
        """Return whether something of a size may be put. If not, it counts as dropped."""
        fits = self._bytes + size <= MAX_NUMBERED_BYTES
        self.dropped += not fits
        return fits

    def in_loop(self, call: Callable[[], None]) -> None:
        """Call something in the event loop. Thread-safe."""
        try:
            self._loop.call_soon_threadsafe(call)
        except RuntimeError:  # the loop has been closed without `close`
            self._closed = True

    @property
    def waiting_bytes(self) -> int:
        """The size of what waits for the event loop."""
        return self._bytes

    def close(self) -> None:
        """Handle nothing more, and release a thread that waits for space."""
        with self._space:
            self._closed = True
            self._space.notify_all()

    def _wait_for_space(self, max_bytes: int) -> bool:
        if self._bytes <= max_bytes:
            return True
        return self._space.wait_for(lambda: self._closed or self._bytes <= max_bytes, MAX_BLOCK_SEC)

    def _begin(self) -> None:
        if self._budget.exhausted:
            self._budget.wait(self)
        else:
            self.go_on_reading()

    def go_on_reading(self) -> None:
        """Handle a share of what waits (`read_budget.Reader`)."""
        self._scheduled = False
        began = self._budget.clock()
        try:
            self._handle_share(began)
        finally:  # the others go on, also after a bug in a handler
            with self._space:
                self._bytes -= self._handled_bytes
                self._space.notify_all()
            self._handled_bytes = 0
            self._host.flush()
            self._budget.spend(self._budget.clock() - began)
            if self._items and not self._scheduled and not self._closed:
                self._scheduled = True
                self._budget.wait(self)

    def _handle_share(self, began: float) -> None:
        clock, spent = self._budget.clock, 0.0
        for _ in range(min(len(self._items), SHARE_FRAMES)):
            if self._closed or spent > SHARE_SEC:
                break
            handler, domain, item, size = self._items.popleft()
            self._handled_bytes += size
            try:
                handler(domain, item)
            except (ProtocolError, ValueError) as error:
                self.malformed += 1
                self._host.warn("malformed messages", "Mesh: received something malformed: %s", error)
            spent = clock() - began
