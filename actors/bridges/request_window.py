"""How many requests one server of another network gets at a time; the others wait here.

A service of ROS 2 keeps the newest requests and forgets older ones without an error, so a busy server must
not get more than it keeps.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import Final, Generic, TypeVar

MAX_IN_FLIGHT: Final = 10
"""Requests without a response that a server gets: the depth of services in ROS 2."""
MAX_WAITING: Final = 500
"""Requests that wait for one server; one more is refused. At 10 ms each, the last one waits for 5 s."""
MAX_WAITING_BYTES: Final = 64 * 1024 * 1024
"""The same in bytes; a request that waits alone may have any size."""
ABANDONED_SEC: Final = 10.0
"""How long a request counts as in flight after its caller has given up: it may still be in the server's
queue, but a request that was lost must not count for ever."""
TAKEN_SEC: Final = 1.0
"""How long a request counts as in flight if its response may be hours away, such as one for the result of a
goal. A server takes these from its queue at once, and only the queue must not be full."""

T = TypeVar("T")


class RequestWindow(Generic[T]):
    """The requests to one server.

    Args:
        is_long: Whether responses may take hours although the server takes requests at once.
        max_in_flight, max_waiting, max_waiting_bytes: See the constants.

    Attributes:
        waiting_bytes: The total size of the requests that wait.
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
        """The number of requests that were sent and may still be in the server's queue."""
        return len(self._in_flight)

    @property
    def waiting(self) -> int:
        """The number of requests that wait."""
        return len(self._waiting)

    def put(self, key: int, request: T, size: int) -> str:
        """Add a request to those that wait.

        Args:
            key: Identifies the request; never used again.
            request: The request.
            size: Its size in bytes.

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
            now: A monotonic time in seconds.
        """
        if not self._waiting:
            return None
        if len(self._in_flight) >= self._most:
            # These are few, because only this method adds to them.
            self._in_flight = {key: until for key, until in self._in_flight.items() if until > now}
            if len(self._in_flight) >= self._most:
                return None
        key, (request, size) = self._waiting.popitem(last=False)
        self.waiting_bytes -= size
        self._in_flight[key] = now + TAKEN_SEC if self._is_long else math.inf
        return key, request

    def responded(self, key: int) -> None:
        """Remove a request that has its response, or that was not sent after all."""
        self._in_flight.pop(key, None)

    def abandon(self, key: int, now: float) -> None:
        """Forget a request whose caller has given up; if it was sent, it counts for some more seconds.

        Args:
            key: The request; nothing happens if it has its response.
            now: A monotonic time in seconds.
        """
        found = self._waiting.pop(key, None)
        if found is not None:
            self.waiting_bytes -= found[1]
        elif key in self._in_flight:
            self._in_flight[key] = min(self._in_flight[key], now + ABANDONED_SEC)

    def next_space(self) -> float:
        """Return when the next request can be sent if no response arrives; infinity for never."""
        if not self._waiting or len(self._in_flight) < self._most:
            return math.inf
        return min(self._in_flight.values())

    def pop_waiting(self) -> list[int]:
        """Forget the requests that wait, and return their keys."""
        keys = list(self._waiting)
        self._waiting.clear()
        self.waiting_bytes = 0
        return keys

    def forget_in_flight(self) -> None:
        """Forget the requests that were sent, because the server that has got them is gone."""
        self._in_flight.clear()

    def clear(self) -> None:
        """Forget all requests."""
        self._waiting.clear()
        self._in_flight.clear()
        self.waiting_bytes = 0
