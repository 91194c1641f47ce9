"""The results of a benchmark, with every sample; written and read as JSON."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, NamedTuple

import msgspec

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from benchmarks.harness.contender import Contender


class Sample(msgspec.Struct, frozen=True, kw_only=True):
    """The figures of one trial."""

    workload: str
    case: str
    contender: str
    repetition: int
    figures: dict[str, float]


class Failure(msgspec.Struct, frozen=True, kw_only=True):
    """A failed trial and its reason."""

    workload: str
    case: str
    contender: str
    repetition: int
    reason: str


class Entrant(msgspec.Struct, frozen=True, kw_only=True):
    """A contender in the report."""

    name: str
    version: str
    brokered: bool

    @classmethod
    def of(cls, contender: Contender) -> Entrant:
        """Return the entrant of a contender."""
        return cls(name=contender.name, version=contender.version, brokered=contender.brokered)


class Spread(NamedTuple):
    """One figure over all repetitions."""

    median: float
    least: float
    most: float


class Results(msgspec.Struct, kw_only=True):
    """A whole run.

    Attributes:
        machine: CPU, cores, system, Python.
        date: Start, ISO 8601, UTC.
        command: The command line.
        seconds: Length of each load.
        repetitions: Trials of each case by each contender.
        entrants: The contenders in order; callboard is the first.
        skipped: Contenders and workloads that did not take part, with the reason.
    """

    machine: dict[str, str]
    date: str
    command: str
    seconds: float
    repetitions: int
    entrants: list[Entrant]
    skipped: dict[str, str] = {}
    samples: list[Sample] = []
    failures: list[Failure] = []

    def figures(self, workload: str, case: str, contender: str) -> dict[str, Spread]:
        """Return each figure that a contender has in a case, over all repetitions."""
        found: dict[str, list[float]] = {}
        for sample in self.samples:
            if (sample.workload, sample.case, sample.contender) == (workload, case, contender):
                for key, value in sample.figures.items():
                    found.setdefault(key, []).append(value)
        return {key: spread(values) for key, values in found.items()}

    def document(self) -> dict[str, Any]:
        """Return the results as JSON types, with medians added."""
        tried = dict.fromkeys((each.workload, each.case, each.contender) for each in self.samples)
        medians = [
            {
                "workload": workload,
                "case": case,
                "contender": contender,
                "figures": {
                    key: figure._asdict() for key, figure in self.figures(workload, case, contender).items()
                },
            }
            for workload, case, contender in tried
        ]
        return {**msgspec.to_builtins(self), "medians": medians}


def spread(values: Sequence[float]) -> Spread:
    """Return median, least and most of one or more values."""
    return Spread(statistics.median(values), min(values), max(values))


def advantage(own: float, other: float, *, more_is_better: bool) -> float:
    """Return how many times better `own` is than `other`: 2.0 is twice the rate, or half the delay."""
    better, worse = (own, other) if more_is_better else (other, own)
    return better / worse if worse else float("inf")
