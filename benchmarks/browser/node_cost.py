"""What the service `~/get_diagnostics` costs a node: memory, and time to start."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Any, Final

from benchmarks.browser.site import Site, percent
from benchmarks.faults.figures import Section

if TYPE_CHECKING:
    from collections.abc import Sequence

NODES: Final = 200
"""Of a process."""
PAIRS: Final = 5
"""Starts of each kind in a process."""

FIGURES: Final = {
    "kib": ("memory, KiB", 1.0),
    "start": ("time to start, us", 1e6),
    "cpu": ("CPU time to start, us", 1e6),
}
"""By name: title and factor."""

Pair = tuple[float, float]


async def measure(rounds: int) -> dict[str, list[Pair]]:
    """Return the figures of nodes without and with the service, in pairs that were measured side by side."""
    pairs: dict[str, list[Pair]] = {name: [] for name in FIGURES}
    async with Site() as site:
        for _ in range(rounds):
            starts = [await _process(site, first=first) for first in (False, True)]
            pairs["kib"].append((starts[0][0]["kib"], starts[1][0]["kib"]))
            for found in starts:
                for one, other in zip(found[1::2], found[2::2], strict=True):
                    without, with_service = sorted((one, other), key=lambda each: each["service"])
                    for name in ("start", "cpu"):
                        pairs[name].append((without[name], with_service[name]))
    return pairs


async def _process(site: Site, *, first: bool) -> Sequence[dict[str, Any]]:
    """Start nodes in a new process: once for the memory, and in pairs, whose order alternates, for times."""
    order = [first, *([first, not first, not first, first] * PAIRS)[: 2 * PAIRS]]
    process = await site.play_at_once("cost", nodes=NODES, order=order)
    rounds: Sequence[dict[str, Any]] = (await process.wait_for_event("cost"))["rounds"]
    await site.stop(process)
    return rounds


def section(pairs: dict[str, list[Pair]]) -> Section:
    """Return the table."""
    rows: list[list[str]] = []
    for name, (title, factor) in FIGURES.items():
        without, with_service = (factor * median(each) for each in zip(*pairs[name], strict=True))
        ratios = percent([after / before for before, after in pairs[name]])
        rows.append([title, str(len(pairs[name])), f"{without:.1f}", f"{with_service:.1f}", *ratios])
    return Section(
        key="node",
        title="a node without and with its diagnostics service",
        text=f"{NODES} nodes of one process. Ratios are those of pairs: the median, and the quartiles.",
        heading=["", "pairs", "without", "with", "difference", "lower quartile", "upper quartile"],
        rows=rows,
        figures=dict(pairs),
    )
