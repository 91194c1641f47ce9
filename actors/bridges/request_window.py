"""How many requests one server of another network gets at a time; the others wait here.

Services of ROS 2 keep the last requests that have arrived and forget older ones without an error, so that a
busy server must not get more than it keeps.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import Final, Generic, TypeVar

MAX_IN_FLIGHT: Final = 10
"""Requests without a response that a server gets: the depth of services in ROS 2."""
MAX_WAITING: Final = 500
"""Requests that wait for one server; one more is refused. With 10 ms for each they take 5 s."""
MAX_WAITING_BYTES: Final = 64 * 1024 * 1024
"""The same in bytes; a single request may have any size."""
ABANDONED_SEC: Final = 10.0
"""How long a request counts whose caller has given up: the server may still have it before it, but a request
that was lost must not count for ever."""
TAKEN_SEC: Final = 1.0
"""When a request counts as taken whose response may be hours away, such as that for the result of a goal:
only the server's queue must not be full, and a server takes these at once."""

T = TypeVar("T")


class RequestWindow(Generic[T]):
    """The requests to one server.

    Args:
        is_long: Whether a response may take hours, while requests are taken at once.
        max_in_flight, max_waiting, max_waiting_bytes: See the constants.

    Attributes:
        waiting_bytes: The size of the requests that wait.
    """

    def __init__(
        self,
        *,
        is_long: bool = False,
        max_in_flight: int = MAX_IN_FLIGHT,
        max_waiting: int = MAX_WAITING,
        max_waiting_bytes: int = MAX_WAITING_BYTES,
    ) -> None:
        self._is_long = is_long
        self._most, self._max_waiting, self._max_bytes = max_in_flight, max_waiting, max_waiting_bytes
        self._waiting: OrderedDict[int, tuple[T, int]] = OrderedDict()
        self._in_flight: dict[int, float] = {}
        self.waiting_bytes = 0

    @property
    def in_flight(self) -> int:
        """How many requests have neither a response nor been given up for lost."""
        return len(self._in_flight)

    @property
    def waiting(self) -> int:
        """How many requests wait."""
        return len(self._waiting)

    def put(self, key: int, request: T, size: int) -> str:
        """Let a request wait.

        Args:
            key: Identifies it; never used again.
            request: It.
            size: Its bytes.

        Returns:
            Why there is no space for it; "" if it waits.
        """
        if len(self._waiting) >= self._max_waiting:
            return f"{self._max_waiting} requests wait already"
        if self._waiting and self.waiting_bytes + size > self._max_bytes:
            return f"requests of {self.waiting_bytes} bytes wait already"
        self._waiting[key] = request, size
        self.waiting_bytes += size
        return ""

    def pop(self, now: float) -> tuple[int, T] | None:
        """Return the oldest request that waits, to be sent now; None if there is none, or no space.

        Args:
            now: The time.
        """
        if not self._waiting:
            return None
        if len(self._in_flight) >= self._most:
            # Seldom more than a few: each of them was sent by this method.
            self._in_flight = {key: until for key, until in self._in_flight.items() if until > now}
            if len(self._in_flight) >= self._most:
                return None
        key, (request, size) = self._waiting.popitem(last=False)
        self.waiting_bytes -= size
        self._in_flight[key] = now + TAKEN_SEC if self._is_long else math.inf
        return key, request

    def responded(self, key: int) -> None:
        """Note that a request has its response, or was not sent after all."""
        self._in_flight.pop(key, None)

    def abandon(self, key: int, now: float) -> None:
        """Forget a request whose caller has given up, if it waits; otherwise it counts for some time.

        Args:
            key: The request; any, also one that has its response.
            now: The time.
        """
        found = self._waiting.pop(key, None)
        if found is not None:
            self.waiting_bytes -= found[1]
        elif key in self._in_flight:
            self._in_flight[key] = min(self._in_flight[key], now + ABANDONED_SEC)

    def next_space(self) -> float:
        """Return when there is space for what waits, if no response arrives; infinity for never."""
        if not self._waiting or len(self._in_flight) < self._most:
            return math.inf
        return min(self._in_flight.values())

    def pop_waiting(self) -> list[int]:
        """Forget the requests that wait; return them."""
        keys = list(self._waiting)
        self._waiting.clear()
        self.waiting_bytes = 0
        return keys

    def forget_in_flight(self) -> None:
        """Count those no more that were sent: the server that has got them is gone."""
        self._in_flight.clear()

    def clear(self) -> None:
        """Forget all requests."""
        self._waiting.clear()
        self._in_flight.clear()
        self.waiting_bytes = 0
