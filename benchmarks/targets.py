"""What callboard wants to reach, as data, and whether a run's results reach it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from benchmarks.harness.results import advantage
from benchmarks.harness.workloads import WORKLOADS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from benchmarks.harness.results import Entrant, Results

OWN: Final = "callboard"


class Ratio(NamedTuple):
    """How much better than the best of some peers callboard wants to be."""

    workload: str
    cases: tuple[str, ...]
    figure: str
    least: float
    whom: str
    among: Callable[[Entrant], bool]


class Ceiling(NamedTuple):
    """What a figure of callboard's own may be at most."""

    workload: str
    figure: str
    most: float


def _any(entrant: Entrant) -> bool:
    return not entrant.name.startswith(OWN)


def _brokered(entrant: Entrant) -> bool:
    return _any(entrant) and entrant.brokered and "shared memory" not in entrant.name


def _brokerless(entrant: Entrant) -> bool:
    return _any(entrant) and not entrant.brokered


def _nats(entrant: Entrant) -> bool:
    return entrant.name == "nats-py"


RATIOS: Final = (
    Ratio("W1", ("16 B", "256 B"), "rate", 2, "the best peer", _any),
    Ratio("W1", ("16 B", "256 B"), "rate", 6, "nats-py", _nats),
    Ratio("W1", ("4 KiB",), "rate", 1.5, "the best brokered peer", _brokered),
    Ratio("W1", ("64 KiB", "1 MiB"), "rate", 1.2, "the best brokered peer without shared memory", _brokered),
    Ratio("W2", ("256 B",), "rate", 2, "the best peer", _any),
    Ratio("W3", ("1 in flight",), "p50_us", 2, "nats-py", _nats),
    Ratio("W3", ("1 in flight",), "p50_us", 1, "the best brokerless peer", _brokerless),
    Ratio("W4", ("100 in flight",), "rate", 3, "the best peer", _any),
)
CEILINGS: Final = (Ceiling("W5", "kib", 10), Ceiling("W5", "idle_cpu_percent", 0.5))

FLAT: Final = 1.5
"""How many times what it costs with the least of something it may cost with the most (W8)."""
CALM: Final = 2.0
"""How many times their 99th percentile alone small messages may need beside a stream (W7)."""


class Verdict(NamedTuple):
    """A target and what was found."""

    what: str
    target: str
    found: str
    reached: bool


def verdicts(results: Results) -> list[Verdict]:
    """Return a verdict for each target that the results say something about."""
    ratios = [verdict for target in RATIOS for verdict in _ratios(results, target)]
    ceilings = [verdict for target in CEILINGS for verdict in _ceilings(results, target)]
    return [*ratios, *ceilings, *_calm(results), *_flat(results)]


def _ratios(results: Results, target: Ratio) -> Iterator[Verdict]:
    workload = next(each for each in WORKLOADS if each.id == target.workload)
    figure = next(each for each in workload.figures if each.key == target.figure)
    for case in target.cases:
        own = results.figures(target.workload, case, OWN).get(target.figure)
        found: list[tuple[float, str]] = []
        for entrant in filter(target.among, results.entrants):
            theirs = results.figures(target.workload, case, entrant.name).get(target.figure)
            if own is not None and theirs is not None:
                ratio = advantage(own.median, theirs.median, more_is_better=figure.more_is_better)
                found.append((ratio, entrant.name))
        if found:
            ratio, name = min(found)
            text = f"{target.least:g} x {target.whom} in {figure.title}"
            yield Verdict(f"{target.workload} {case}", text, f"{ratio:.2f} x {name}", ratio >= target.least)


def _ceilings(results: Results, target: Ceiling) -> Iterator[Verdict]:
    workload = next(each for each in WORKLOADS if each.id == target.workload)
    figure = next(each for each in workload.figures if each.key == target.figure)
    for case in workload.cases:
        own = results.figures(target.workload, case.name, OWN).get(target.figure)
        if own is not None:
            text = f"{figure.title} at most {target.most:g}"
            reached = own.median <= target.most
            yield Verdict(f"{target.workload} {case.name}", text, f"{own.median:.2f}", reached)


def _calm(results: Results) -> Iterator[Verdict]:
    (workload,) = (each for each in WORKLOADS if each.id == "W7")
    alone, *beside = [(case, results.figures("W7", case.name, OWN)) for case in workload.cases]
    for case, figures in beside:
        if "p99_us" in figures and "p99_us" in alone[1]:
            ratio = figures["p99_us"].median / alone[1]["p99_us"].median
            target = f"p99 at most {CALM:g} x that without a stream"
            yield Verdict(f"W7 {case.name}", target, f"{ratio:.2f} x", ratio <= CALM)


def _flat(results: Results) -> Iterator[Verdict]:
    curves: dict[str, list[tuple[int, float]]] = {}
    for workload in WORKLOADS:
        for case in workload.cases:
            figures = results.figures(workload.id, case.name, OWN)
            if case.curve is not None and "cost_us" in figures:
                curves.setdefault(case.curve[0], []).append((case.curve[1], figures["cost_us"].median))
    for what, points in curves.items():
        (fewest, first), (most, last) = min(points), max(points)
        if most > fewest:
            target = f"{most:,} cost at most {FLAT:g} x what {fewest:,} costs, for each message"
            yield Verdict(f"W8 {what}", target, f"{last / first:.2f} x", last / first <= FLAT)
