"""Whether the memory of pages that are left open grows."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Final, NamedTuple

from benchmarks.browser.site import PER_SECOND, Memory, Site
from benchmarks.faults.figures import Section, slope

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MINUTE_S: Final = 60.0
VISITORS: Final = 10
"""Nodes that come and go, every second."""
FIELD: Final = "linear_acceleration.x"
SETTLED: Final = 1
"""Samples that do not count for the growth: a plot first fills its buffer of 100,000 points."""
GROWTH: Final = 0.05
"""What the heap may grow from the first sample that counts to the last, by the line through them."""


class Sample(NamedTuple):
    """One of a page."""

    minute: float
    memory: Memory


async def measure(minutes: int, nodes: int) -> dict[str, list[Sample]]:
    """Show the echo, a plot and the graph while nodes come and go; sample each page after each minute."""
    async with Site() as site:
        await site.fill(nodes)
        await site.play("visitors", first=nodes, count=VISITORS)
        windows = {name: await site.window() for name in ("echo", "plot", "graph")}
        await windows["echo"].load("topic/%2Fstream")
        plot = windows["plot"]
        await plot.load("topic/%2Fstream")
        await plot.page.get_by_role("button", name=f"Plot {FIELD}", exact=True).click()
        await plot.show("plot")
        await windows["graph"].load()
        await windows["graph"].drawn(site.vertices)
        began = time.monotonic()
        found: dict[str, list[Sample]] = {name: [] for name in windows}
        for minute in range(1, minutes + 1):
            await asyncio.sleep(max(0.0, began + minute * MINUTE_S - time.monotonic()))
            for name, window in windows.items():
                found[name].append(Sample((time.monotonic() - began) / MINUTE_S, await window.memory()))
            heaps = [f"{name} {each[-1].memory.heap_bytes / 1e6:.2f} MB" for name, each in found.items()]
            print(f"    after {minute} min: {', '.join(heaps)}", flush=True)
        return found


def growth(samples: Sequence[Sample]) -> dict[str, float]:
    """Return the change of each figure from its first sample to the last, by the line through all of them."""
    length = samples[-1].minute - samples[0].minute
    return {
        field: slope([(each.minute, getattr(each.memory, field)) for each in samples]) * length
        for field in Memory._fields
    }


def section(found: Mapping[str, Sequence[Sample]]) -> Section:
    """Return the table; a heap that grows is a failure."""
    rows: list[list[str]] = []
    failures: list[str] = []
    for name, samples in found.items():
        first, grown = samples[0].memory, growth(samples[SETTLED:])
        part = grown["heap_bytes"] / first.heap_bytes
        rows.append(
            [
                name,
                *(f"{each.memory.heap_bytes / 1e6:.2f}" for each in (samples[0], samples[-1])),
                f"{100 * part:+.1f} %",
                *(f"{getattr(first, field)} {grown[field]:+.0f}" for field in ("nodes", "listeners")),
            ]
        )
        if part > GROWTH:
            failures.append(f"{name}: the heap grows by {100 * part:.1f} %, the limit is {100 * GROWTH:g} %")
    minutes = len(next(iter(found.values())))
    return Section(
        key="memory",
        title=f"pages open for {minutes} minutes, {PER_SECOND} messages/s, {VISITORS} nodes come and go",
        text=(
            "The heap in MB after a collection of garbage, at the end of the first minute and of the last;"
            " its growth from the second minute on, and that of DOM nodes and listeners, by the line through"
            " the samples."
        ),
        heading=["page", "first", "last", "growth", "nodes", "listeners"],
        rows=rows,
        figures={
            name: [{"minute": each.minute, **each.memory._asdict()} for each in samples]
            for name, samples in found.items()
        },
        failures=failures,
    )
