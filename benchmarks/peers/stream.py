"""One stream of messages, counted at both ends: the mark of its end, the window for systems that would drop.

Three kinds of message travel on the stream and differ in length: the load (`size` bytes, 16 at least), a
probe (nothing), with which the publisher finds its subscribers, and the end mark, which has the number of
messages sent. A subscriber process answers with an acknowledgement: who it is, and how many messages each of
its subscriptions has had.
"""

from __future__ import annotations

import asyncio
import math
import os
import queue
import struct
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from benchmarks.peers.roles import MATCHING_S, Parameters, Parent

if TYPE_CHECKING:
    from collections.abc import Awaitable

PROBE = b""
PROBE_INTERVAL_S = 0.1
WINDOW_BYTES = 8 << 20
WINDOW_MESSAGES = 16384
"""As much as 8 MiB and 16,384 messages: several times what lies between the ends of a full pipe."""
ACKNOWLEDGEMENTS_PER_WINDOW = 8
BURST_BYTES = 128 << 10
BURST_MESSAGES = 128
"""What is sent before the publisher reads the clock and lets its event loop turn."""

_END = struct.Struct("<Q")
_ACKNOWLEDGEMENT = struct.Struct("<QQ")


def window_messages(size: int) -> int:
    """How many messages of a size may be under way."""
    return max(ACKNOWLEDGEMENTS_PER_WINDOW, min(WINDOW_MESSAGES, WINDOW_BYTES // size))


def burst_messages(size: int) -> int:
    """How many messages of a size are sent between two readings of the clock."""
    return max(1, min(BURST_MESSAGES, BURST_BYTES // size))


def end_mark(sent: int) -> bytes:
    """What follows the last message."""
    return _END.pack(sent)


class Tally:
    """What a subscriber process counts, over all its subscriptions.

    `take` is on the hot path: one comparison, one sum, one comparison.

    Args:
        parameters: size and subscriptions.
        windowed: whether the publisher needs to know how far we are, not only that we have all.
    """

    def __init__(self, parameters: Parameters, *, windowed: bool = False) -> None:
        self.finished = False
        self._size = parameters.size
        self._subscriptions = parameters.subscriptions
        step = window_messages(parameters.size) // ACKNOWLEDGEMENTS_PER_WINDOW * parameters.subscriptions
        self._step: float = step if windowed else math.inf
        self._count = 0
        self._milestone: float = 1
        self._ends = 0
        self._sent = 0
        self._first_s = 0.0
        self._last_s = 0.0

    def take(self, data: bytes) -> bytes | None:
        """Count what came. Send what this returns to the publisher, then see whether `finished`."""
        if len(data) == self._size:
            self._count += 1
            if self._count >= self._milestone:
                return self._reach_milestone()
            return None
        return self._take_mark(data)

    def _reach_milestone(self) -> bytes | None:
        if self._count == 1:
            self._first_s = time.perf_counter()
            self._milestone = self._step
            if self._step > 1:
                return None
        self._milestone = self._count + self._step
        return self._acknowledgement()

    def _take_mark(self, data: bytes) -> bytes:
        if data:
            (self._sent,) = _END.unpack(data)
            self._ends += 1
            self._last_s = time.perf_counter()
            self.finished = self._ends == self._subscriptions
        return self._acknowledgement()

    def _acknowledgement(self) -> bytes:
        return _ACKNOWLEDGEMENT.pack(os.getpid(), self._count // self._subscriptions)

    def report(self, parent: Parent) -> None:
        """Give the parent the figures of a finished stream."""
        elapsed_s = self._last_s - self._first_s
        parent.done(
            messages=self._count,
            received=self._count,
            lost=self._sent * self._subscriptions - self._count,
            elapsed_s=elapsed_s,
            rate=self._count / elapsed_s,
        )


class Readers:
    """What a publisher knows of its subscriber processes: who has answered, and how far the slowest is."""

    def __init__(self, parameters: Parameters) -> None:
        self._expected = parameters.readers
        self._counts: dict[int, int] = {}
        self._changed = asyncio.Event()

    @property
    def matched(self) -> bool:
        """Whether every subscriber process has answered a probe."""
        return len(self._counts) == self._expected

    @property
    def slowest(self) -> int:
        """How many messages every subscription has had, as far as is known."""
        return min(self._counts.values())

    def take(self, acknowledgement: bytes) -> None:
        """Take an acknowledgement from the peer's own channel."""
        reader, count = _ACKNOWLEDGEMENT.unpack(acknowledgement)
        self._counts[reader] = count
        self._changed.set()

    async def change(self) -> None:
        """Wait for the next acknowledgement."""
        self._changed.clear()
        await self._changed.wait()


Receive = Callable[[float], bytes | None]
"""Waits so many seconds for an acknowledgement, for peers whose publisher blocks."""


def match_readers(readers: Readers, probe: Callable[[], object], receive: Receive) -> None:
    """Probe until every subscriber process has answered."""
    deadline_s = time.monotonic() + MATCHING_S
    while not readers.matched:
        if time.monotonic() > deadline_s:
            raise TimeoutError("not every subscriber process answers")
        probe()
        acknowledgement = receive(PROBE_INTERVAL_S)
        if acknowledgement is not None:
            readers.take(acknowledgement)


def wait_for_end(readers: Readers, sent: int, receive: Receive) -> None:
    """Wait until every subscription has had all, or the role's time is up."""
    while readers.slowest < sent:
        acknowledgement = receive(PROBE_INTERVAL_S)
        if acknowledgement is not None:
            readers.take(acknowledgement)


def receive_from(mailbox: queue.SimpleQueue[bytes]) -> Receive:
    """Receive what another thread puts into a queue."""

    def receive(timeout_s: float) -> bytes | None:
        try:
            return mailbox.get(timeout=timeout_s)
        except queue.Empty:
            return None

    return receive


def publish_blocking(parent: Parent, parameters: Parameters, send: Callable[[bytes], object]) -> int:
    """Publish for the time of the load with a call that waits when the system is full; say how often."""
    parent.mark()
    payload = bytes(parameters.size)
    burst = burst_messages(parameters.size)
    sent = 0
    stop_s = time.perf_counter() + parameters.seconds
    while time.perf_counter() < stop_s:
        for _ in range(burst):
            send(payload)
        sent += burst
    send(end_mark(sent))
    return sent


async def publish_in_window(
    parent: Parent,
    parameters: Parameters,
    readers: Readers,
    send: Callable[[bytes, int], Awaitable[None]],
    *,
    bursts: int = 1,
) -> None:
    """Be a publisher of a system that drops what its subscribers are too slow for.

    Args:
        parent: whom to report to.
        parameters: size, seconds, readers.
        readers: which the caller feeds with acknowledgements.
        send: sends a payload so many times; when it returns all may still be in the library's own buffer.
        bursts: how many of the usual bursts go at once, where each has to be waited for.
    """
    async with asyncio.timeout(MATCHING_S):
        while not readers.matched:
            await send(PROBE, 1)
            try:
                await asyncio.wait_for(readers.change(), PROBE_INTERVAL_S)
            except TimeoutError:
                continue
    parent.mark()
    payload = bytes(parameters.size)
    window, burst = window_messages(parameters.size), bursts * burst_messages(parameters.size)
    sent = 0
    stop_s = time.perf_counter() + parameters.seconds
    while time.perf_counter() < stop_s:
        count = min(burst, readers.slowest + window - sent)
        if count > 0:
            await send(payload, count)
            sent += count
            await asyncio.sleep(0)  # let the library write, and acknowledgements in
        else:
            await readers.change()
    await send(end_mark(sent), 1)
    while readers.slowest < sent:
        await readers.change()
    parent.done(messages=sent, sent=sent)
