"""A connection on which other threads than the loop's write, too: calls, and the replies to them.

If the loop sent them, each would wait for a change of threads, which is most of the time of a single call. Of
many, the first would wait until the thread has made the last.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from proto.aio.channel import Channel

if TYPE_CHECKING:
    import asyncio

MAX_BYTES: Final = 4096
"""The largest frame that another thread writes. Linux usually writes that much to a unix socket as a whole or
not at all; the rest of a frame has to wait for the loop, and everything else for it."""

LOCK_SEC: Final = 0.1
"""How long the loop waits for a thread that writes. Not forever: it may be in a signal handler that waits for
the loop."""


class ThreadChannel(Channel):
    """A channel with `write_now`, for nodes whose program runs in other threads. Arguments are Channel's."""

    __slots__ = ("_lock", "_rest", "_socket")

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._lock = threading.RLock()  # the handler of a signal that interrupts `write_now` may call it
        """Held while frames are written."""
        self._rest = b""
        """Of a frame that a thread has written in part: sandboxes such as gVisor do, and small buffers."""
        self._socket: socket.socket | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by asyncio."""
        sock = transport.get_extra_info("socket")
        # Not with asyncio's own transports: since Python 3.12 they take a frame out of their buffer before
        # they put the unsent rest back, and a thread would find the buffer empty in between.
        if sys.platform == "linux" and not self._joins and sock is not None and sock.family == socket.AF_UNIX:
            with suppress(OSError):  # too many open files: then the loop writes everything
                # A descriptor of its own. The transport closes the other one at any time, and then its number
                # may be another file's.
                self._socket = socket.socket(fileno=os.dup(sock.fileno()))
                self._socket.settimeout(0)  # whatever `socket.setdefaulttimeout` says
        super().connection_made(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by asyncio."""
        sock, self._socket = self._socket, None
        if sock is not None:
            locked = self._lock.acquire(timeout=LOCK_SEC)  # for the same reason
            sock.close()
            if locked:
                self._lock.release()
        super().connection_lost(exc)

    def descriptors(self) -> tuple[int, ...]:
        """Return the connection's descriptors, if there is one (DescriptorOwner)."""
        sock = self._socket
        return super().descriptors() if sock is None else (*super().descriptors(), sock.fileno())

    def flush(self) -> None:
        """Write queued frames, unless another thread writes for long: then soon."""
        if self._lock.acquire(timeout=LOCK_SEC):
            try:
                if self._rest and self._transport is not None:
                    rest, self._rest = self._rest, b""
                    self._transport.write(rest)
                super().flush()
            finally:
                self._lock.release()
        else:
            self._flush_due = False
            self.flush_soon()

    def write_now(self, raw: bytes) -> bool:
        """Write a frame at once; in any thread.

        Args:
            raw: The encoded frame.

        Returns:
            False if nothing was written: the frame is large, calls or parts of a frame wait to be written, or
            there is no connection on which threads may write. Then the loop has to send it.
        """
        sock, transport = self._socket, self._transport
        if sock is None or transport is None or len(raw) > MAX_BYTES:
            return False
        with self._lock:
            # What the transport has not written yet may be the rest of a frame. What the outbox has of calls
            # came before this.
            if not self.connected or self.busy or self._rest or self.outbox.urgent_bytes:
                return False
            if transport.get_write_buffer_size():
                return False
            try:
                self._rest = raw[sock.send(raw) :]
            except OSError:  # the connection is full, or ends
                return False
            self.bytes_sent += len(raw)
            if self._rest:
                with suppress(RuntimeError):  # the loop is closed
                    self._loop.call_soon_threadsafe(self.flush)
            return True
