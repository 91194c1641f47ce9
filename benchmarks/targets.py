"""What callboard wants to reach, as data, and whether a run's results reach it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from actors.bench.results import advantage
from actors.bench.workloads import WORKLOADS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.bench.results import Results
    from actors.bench.workloads import Case, Figure, Workload

AHEAD = {"W1": "rate", "W2": "rate", "W3": "p50_us", "W4": "rate", "W5": "kib"}
"""The figure in which callboard is to be at least as good as every peer with a server in between."""
FLAT = 1.5
"""How many times what it costs with the least of something it may cost with the most (W8)."""
CALM = 2.0
"""How many times their 99th percentile alone small messages may need beside a stream (W7)."""


class Verdict(NamedTuple):
    """A target and what was found."""

    what: str
    target: str
    found: str
    reached: bool


def verdicts(results: Results) -> list[Verdict]:
    """Return a verdict for each target that the results say something about."""
    return [*_ahead(results), *_calm(results), *_flat(results)]


def _ahead(results: Results) -> Iterator[Verdict]:
    for workload in WORKLOADS:
        for figure in workload.figures:
            if figure.key == AHEAD.get(workload.id):
                for case in workload.cases:
                    yield from _against_best(results, workload, case, figure)


def _against_best(results: Results, workload: Workload, case: Case, figure: Figure) -> Iterator[Verdict]:
    medians = {
        entrant.name: results.figures(workload.id, case.name, entrant.name)[figure.key].median
        for entrant in results.entrants
        if entrant.brokered and figure.key in results.figures(workload.id, case.name, entrant.name)
    }
    own = medians.get("callboard")
    peers = {name: value for name, value in medians.items() if not name.startswith("callboard")}
    if own is None or not peers:
        return
    best = (max if figure.more_is_better else min)(peers, key=lambda name: peers[name])
    ratio = advantage(own, peers[best], more_is_better=figure.more_is_better)
    target = f"at least as good as every brokered peer in {figure.title}"
    yield Verdict(f"{workload.id} {case.name}", target, f"{ratio:.2f} x {best}", ratio >= 1)


def _calm(results: Results) -> Iterator[Verdict]:
    (workload,) = (each for each in WORKLOADS if each.id == "W7")
    alone, *beside = [(case, results.figures("W7", case.name, "callboard")) for case in workload.cases]
    for case, figures in beside:
        if "p99_us" in figures and "p99_us" in alone[1]:
            ratio = figures["p99_us"].median / alone[1]["p99_us"].median
            target = f"p99 at most {CALM:g} x that without a stream"
            yield Verdict(f"W7 {case.name}", target, f"{ratio:.2f} x", ratio <= CALM)


def _flat(results: Results) -> Iterator[Verdict]:
    curves: dict[str, list[tuple[int, float]]] = {}
    for workload in WORKLOADS:
        for case in workload.cases:
            figures = results.figures(workload.id, case.name, "callboard")
            if case.curve is not None and "cost_us" in figures:
                curves.setdefault(case.curve[0], []).append((case.curve[1], figures["cost_us"].median))
    for what, points in curves.items():
        (fewest, first), (most, last) = min(points), max(points)
        if most > fewest:
            target = f"{most:,} cost at most {FLAT:g} x what {fewest:,} costs, for each message"
            yield Verdict(f"W8 {what}", target, f"{last / first:.2f} x", last / first <= FLAT)
