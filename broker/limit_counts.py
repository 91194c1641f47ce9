"""Counts of limits that connections have reached, for the statistics."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class LimitCounts:
    """What one run of a broker has refused or ended, apart from what its parts count themselves.

    The names are those of the statistics.
    """

    refused_per_address: int = 0
    tls_failures: int = 0
    reassembly_timeouts: int = 0
