"""How long a message to another broker and its answer take, measured when somebody asks."""

from __future__ import annotations

from typing import Final

PAUSE_US: Final = 100_000
"""Between two measurements, however often somebody asks."""

VALID_US: Final = 10_000_000
"""How long a measurement is shown."""


class RoundTrips:
    """The round trips that have been measured last. Times are in microseconds.

    Attributes:
        by_broker: The round trips, by the numbers of brokers.
    """

    def __init__(self) -> None:
        self.by_broker: dict[int, int] = {}
        self._began_us = -PAUSE_US

    def begin(self, now_us: int) -> bool:
        """Return whether to measure again: send each broker a PING with this time as its token."""
        since = now_us - self._began_us
        if since < PAUSE_US:
            return False
        if since > VALID_US:
            self.by_broker.clear()
        self._began_us = now_us
        return True

    def take(self, broker: int, token: int, now_us: int) -> None:
        """Take a broker's answer, unless it answers an earlier PING."""
        if token == self._began_us:
            self.by_broker[broker] = max(1, now_us - token)
