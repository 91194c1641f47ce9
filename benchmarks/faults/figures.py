"""Figures and tables of the resilience report."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Any

import msgspec

from benchmarks.harness.tables import aligned

if TYPE_CHECKING:
    from collections.abc import Sequence


class Section(msgspec.Struct, kw_only=True, frozen=True):
    """The result of one measurement."""

    key: str
    title: str
    text: str
    """A paragraph that explains the table."""
    heading: list[str]
    rows: list[list[str]]
    figures: dict[str, Any]
    """The same figures as numbers."""
    failures: list[str] = []
    """Promises that were violated, in words."""

    def lines(self) -> list[str]:
        """Return the section as lines of text."""
        table = aligned([self.heading, *self.rows])
        return [f"{self.key}  {self.title}", *(f"    {line}" for line in table), *self.failures]


def milliseconds(values_s: Sequence[float]) -> dict[str, float]:
    """Return median, 95th percentile and maximum in ms of times in seconds."""
    ordered = sorted(values_s)
    return {
        "p50_ms": 1000 * median(ordered),
        "p95_ms": 1000 * ordered[round(0.95 * (len(ordered) - 1))],
        "max_ms": 1000 * ordered[-1],
        "count": len(ordered),
    }


def peak(times_s: Sequence[float], window_s: float) -> int:
    """Return the largest number of events within any window."""
    ordered = sorted(times_s)
    most = start = 0
    for stop, time in enumerate(ordered):
        while time - ordered[start] >= window_s:
            start += 1
        most = max(most, stop - start + 1)
    return most


def slope(points: Sequence[tuple[float, float]]) -> float:
    """Return the slope of the least-squares line; 0 if all x are equal."""
    count = len(points)
    mean_x = sum(x for x, _ in points) / count
    mean_y = sum(y for _, y in points) / count
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    if not spread:
        return 0.0
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / spread
