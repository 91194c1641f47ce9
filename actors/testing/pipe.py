"""One direction of a proxied connection: reads, buffers a little, and passes it on as its faults allow."""

from __future__ import annotations

import asyncio
import math
import socket
from collections import deque
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from actors.testing.link_faults import LinkFaults

HELD_BYTES: Final = 64 * 1024
"""Limit of bytes that were read and not passed on; the kernel's buffers hold more on both sides."""

PIECE_BYTES: Final = 16 * 1024
"""Limit of one read or write; so much may still leave after a black hole has begun."""


class _Chunk(NamedTuple):
    """The data of one read; none means the end of the stream."""

    data: bytes
    read_at: float
    jitter_factor: float
    """Part of `jitter_sec` to apply, 0 to 1."""


class Pipe:
    """Carries bytes from one socket to the other.

    Args:
        link_faults: The faults at the start.
        random: Source of the jitter.
        on_progress: Called when bytes were read or passed on.

    Attributes:
        forwarded_bytes: Bytes passed on so far.
        held_bytes: Bytes that were read and not passed on.
    """

    def __init__(self, link_faults: LinkFaults, random: Random, on_progress: Callable[[], None]) -> None:
        self.forwarded_bytes = 0
        self.held_bytes = 0
        self._link_faults = link_faults
        self._random = random
        self._on_progress = on_progress
        self._chunks: deque[_Chunk] = deque()
        self._ended = False
        self._sent_at = -math.inf
        self._reader_wakeup = asyncio.Event()
        self._writer_wakeup = asyncio.Event()

    def change(self, **changes: Any) -> None:
        """Change the faults, also for bytes in transit."""
        self._link_faults = replace(self._link_faults, **changes)
        self._reader_wakeup.set()
        self._writer_wakeup.set()

    def end(self) -> None:
        """End the stream after the bytes in transit; later ones are discarded."""
        if not self._ended:
            self._ended = True
            self._hold(b"")

    def _hold(self, data: bytes) -> None:
        now = asyncio.get_running_loop().time()
        self._chunks.append(_Chunk(data, now, self._random.random()))
        self.held_bytes += len(data)
        self._writer_wakeup.set()
        self._on_progress()

    async def run(self, source: socket.socket, sink: socket.socket) -> None:
        """Carry bytes until the source has ended and all of them are passed on.

        Raises:
            ExceptionGroup: Of OSErrors: one of the sockets broke.
        """
        async with asyncio.TaskGroup() as ends:
            ends.create_task(self._read(source))
            ends.create_task(self._write(sink))

    async def _read(self, source: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            while self._link_faults.black_hole or self.held_bytes >= HELD_BYTES:
                self._reader_wakeup.clear()
                await self._reader_wakeup.wait()
            data = await loop.sock_recv(source, min(PIECE_BYTES, HELD_BYTES - self.held_bytes))
            if not data:
                self.end()
                return
            if not self._ended:
                self._hold(data)

    async def _write(self, sink: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            while (wait_s := self._wait_s(loop.time())) > 0:
                self._writer_wakeup.clear()
                with suppress(TimeoutError):
                    async with asyncio.timeout(None if math.isinf(wait_s) else wait_s):
                        await self._writer_wakeup.wait()
            piece = self._pop_due(loop.time())
            if not piece:
                break
            await loop.sock_sendall(sink, piece)
            self._sent_at = loop.time()
            self.held_bytes -= len(piece)
            self.forwarded_bytes += len(piece)
            self._reader_wakeup.set()
            self._on_progress()
        with suppress(OSError):  # the receiver may have closed it
            sink.shutdown(socket.SHUT_WR)

    def _wait_s(self, now: float) -> float:
        """Return the seconds until the next piece may leave; infinite if only a change can allow it."""
        link_faults = self._link_faults
        if link_faults.black_hole or not self._chunks:
            return math.inf
        next_drip = (
            -math.inf if link_faults.drip_bytes is None else self._sent_at + link_faults.drip_every_sec
        )
        return max(self._due_at(self._chunks[0]), next_drip) - now

    def _due_at(self, chunk: _Chunk) -> float:
        link_faults = self._link_faults
        return chunk.read_at + link_faults.delay_sec + link_faults.jitter_sec * chunk.jitter_factor

    def _pop_due(self, now: float) -> bytes:
        """Remove the bytes that may leave together; none means the end of the stream."""
        most = min(PIECE_BYTES, self._link_faults.drip_bytes or PIECE_BYTES)
        parts: list[bytes] = []
        size = 0
        while size < most and self._chunks and self._chunks[0].data and self._due_at(self._chunks[0]) <= now:
            chunk = self._chunks.popleft()
            part = chunk.data[: most - size]
            if len(part) < len(chunk.data):
                self._chunks.appendleft(chunk._replace(data=chunk.data[len(part) :]))
            parts.append(part)
            size += len(part)
        return b"".join(parts)
