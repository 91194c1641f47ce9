"""Calls of add_two_ints: what they carry, who keeps so many in flight, and how long each took.

A request is two int64, a reply one. Every reply is checked against what was asked.
"""

from __future__ import annotations

import asyncio
import statistics
import struct
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from benchmarks.peers.roles import Parameters, Parent

WARM_UP_CALLS = 200
CALL_S = 20
"""How long one call may take."""

_REQUEST = struct.Struct("<qq")
_NUMBER = struct.Struct("<Q")
_REPLY = struct.Struct("<q")
NUMBERED_REQUEST_BYTES = _NUMBER.size + _REQUEST.size
NUMBERED_REPLY_BYTES = _NUMBER.size + _REPLY.size


def request(number: int) -> bytes:
    """Ask for the sum of two numbers that differ from call to call."""
    return _REQUEST.pack(number, 3)


def reply(data: bytes) -> bytes:
    """Answer a request."""
    a, b = _REQUEST.unpack(data)
    return _REPLY.pack(a + b)


def numbered_request(number: int) -> bytes:
    """A request for systems whose replies need a number to be told apart."""
    return _NUMBER.pack(number) + request(number)


def numbered_reply(data: bytes) -> bytes:
    """Answer a numbered request."""
    return data[: _NUMBER.size] + reply(data[_NUMBER.size :])


def split_number(data: bytes) -> tuple[int, bytes]:
    """Take the number from a numbered reply."""
    (number,) = _NUMBER.unpack_from(data)
    return number, data[_NUMBER.size :]


def check(number: int, data: bytes) -> None:
    """Raise ValueError if it is not the answer to that request."""
    (total,) = _REPLY.unpack(data)
    if total != number + 3:
        raise ValueError(f"{number} + 3 is not {total}")


def report(parent: Parent, times_s: list[float], elapsed_s: float) -> None:
    """Give the parent the figures of a requester."""
    cuts_s = statistics.quantiles(times_s, n=1000)
    parent.done(
        messages=len(times_s),
        calls=len(times_s),
        elapsed_s=elapsed_s,
        rate=len(times_s) / elapsed_s,
        p50_us=cuts_s[499] * 1e6,
        p99_us=cuts_s[989] * 1e6,
        p999_us=cuts_s[998] * 1e6,
    )


class Turns:
    """The same without tasks, for replies that come to a callback or out of a socket.

    Args:
        parent: told when the load begins.
        parameters: seconds and in_flight.
        send: sends the request of that number; the reply, with its number, goes to `take`.
    """

    def __init__(self, parent: Parent, parameters: Parameters, send: Callable[[int], object]) -> None:
        self.finished = False
        self._parent = parent
        self._parameters = parameters
        self._send = send
        self._number = 0
        self._begun_s: dict[int, float] = {}
        self._times_s: list[float] = []
        self._start_s = self._stop_s = self._elapsed_s = 0.0

    def begin(self) -> None:
        """Fill the flight."""
        for _ in range(self._parameters.in_flight):
            self._call()

    def take(self, number: int, data: bytes) -> None:
        """Take a reply, check it and call again; then see whether `finished`."""
        now_s = time.perf_counter()
        check(number, data)
        self._times_s.append(now_s - self._begun_s.pop(number))
        if self._number < WARM_UP_CALLS or now_s < self._stop_s:
            self._call()
        elif not self._begun_s:
            self._end(now_s)

    def report(self) -> None:
        """Give the parent the figures."""
        report(self._parent, self._times_s, self._elapsed_s)

    def _call(self) -> None:
        self._number = number = self._number + 1
        self._begun_s[number] = time.perf_counter()
        self._send(number)

    def _end(self, now_s: float) -> None:
        if self._stop_s:
            self._elapsed_s = now_s - self._start_s
            self.finished = True
            return
        self._times_s.clear()
        self._parent.mark()
        self._start_s = time.perf_counter()
        self._stop_s = self._start_s + self._parameters.seconds
        self.begin()


async def call_in_turns(
    parent: Parent, parameters: Parameters, call: Callable[[bytes], Awaitable[bytes]]
) -> None:
    """Be a requester of a system with an awaitable call: so many tasks, each with one call at a time."""
    times_s: list[float] = []
    number = 0

    async def turns(stop_s: float, warm_up: int) -> None:
        nonlocal number
        while number < warm_up or time.perf_counter() < stop_s:
            number = mine = number + 1
            start_s = time.perf_counter()
            check(mine, await call(request(mine)))
            times_s.append(time.perf_counter() - start_s)

    async def load(stop_s: float, warm_up: int) -> None:
        async with asyncio.TaskGroup() as group:
            for _ in range(parameters.in_flight):
                group.create_task(turns(stop_s, warm_up))

    await load(0.0, WARM_UP_CALLS)
    times_s.clear()
    parent.mark()
    start_s = time.perf_counter()
    await load(start_s + parameters.seconds, 0)
    report(parent, times_s, time.perf_counter() - start_s)
