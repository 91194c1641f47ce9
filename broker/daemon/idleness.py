"""Decides when a broker that ends by itself has been without clients for long enough. Pure.

A connection that has come and gone between two checks counts, too: its bytes show in the statistics.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from proto.wire.stats import BrokerStats

CHECKS: Final = 8
"""Checks within the time after which the broker ends; it ends late by at most one of these parts."""


class Idleness:
    """Measures how long a broker has had no client.

    Args:
        limit_sec: Seconds without a client after which it ends.
        stats: The broker's statistics at its start, from which the first period counts.

    Attributes:
        period_sec: How often to check.
    """

    def __init__(self, limit_sec: float, stats: BrokerStats) -> None:
        self.period_sec = limit_sec / CHECKS
        self._limit_sec = limit_sec
        self._since = stats.stamp_sec
        self._bytes_received = stats.bytes_received

    def is_over(self, stats: BrokerStats) -> bool:
        """Return whether the broker has been idle for the limit.

        Args:
            stats: Its statistics now.
        """
        if stats.connections or stats.bytes_received != self._bytes_received:
            self._since = stats.stamp_sec
            self._bytes_received = stats.bytes_received
        return stats.stamp_sec - self._since >= self._limit_sec
