"""Memory of a broker and of a process whose nodes start and stop as fast as they can."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.faults.figures import Section, slope
from benchmarks.faults.processes import ProcessGroup

HOUR: Final = 3600
"""Lives of nodes: one a second for an hour."""
SAMPLES: Final = 36
WARM_UP: Final = 1 / 6
"""Share of the lives after which caches, free lists and the heap have their final size."""
FLAT_KIB: Final = 1024
"""Growth per hour's worth of lives, of either process, that still counts as constant."""


@dataclass(frozen=True, kw_only=True)
class Results:
    """Samples of lives, memory (KiB) and open files by process; duration; number of connection resets."""

    lives: int
    resets: int
    seconds: float
    samples: list[dict[str, Any]]


async def measure(lives: int = HOUR) -> Results:
    """Start and stop `lives` nodes and sample memory."""
    async with ProcessGroup() as processes:
        broker = await processes.start_broker()
        began = time.monotonic()
        churn = await processes.start_role("churn", lives=lives, samples=SAMPLES, broker_pid=broker.pid)
        samples = [await churn.wait_for_event("sample")]
        while samples[-1]["lives"] < lives:
            samples.append(await churn.wait_for_event("sample"))
        seconds = time.monotonic() - began
        resets = (await churn.wait_for_event("done"))["resets"]
        return Results(lives=lives, resets=resets, seconds=seconds, samples=samples)


def section(found: Results) -> Section:
    """Return the table of memory; growth is a failure."""
    warm = [sample for sample in found.samples if sample["lives"] >= WARM_UP * found.lives]
    rows: list[list[str]] = []
    figures: dict[str, Any] = {
        "lives": found.lives,
        "resets": found.resets,
        "seconds": found.seconds,
        "samples": found.samples,
    }
    failures: list[str] = []
    for process in ("broker", "nodes"):
        # The last sample is taken in another state, after all connections have been restored.
        memory = [(float(sample["lives"]), float(sample["memory_kib"][process])) for sample in warm[:-1]]
        start, end = memory[0][1], memory[-1][1]
        per_1000 = 1000 * slope(memory)
        files = [found.samples[0]["files"][process], found.samples[-1]["files"][process]]
        rows.append(
            [
                process,
                *(f"{kib / 1024:.1f} MiB" for kib in (start, end)),
                f"{per_1000:+,.0f} KiB",
                *map(str, files),
            ]
        )
        figures[process] = {
            "start_kib": start,
            "end_kib": end,
            "kib_per_1000_lives": per_1000,
            "files": files,
        }
        if files[1] > files[0]:
            failures.append(f"{process}: {files[1] - files[0]} files were left open")
        if per_1000 * HOUR / 1000 > FLAT_KIB:
            failures.append(f"the memory of {process} grows: {per_1000:+,.0f} KiB per 1,000 lives")
    return Section(
        key="churn",
        title="nodes start and stop continuously",
        text=(
            f"{found.lives:,} nodes in {found.seconds:.0f} s: as many as one a second for"
            f" {found.lives / HOUR:g} h. Each node has its own connection, 3 latched publishers and 3"
            " subscriptions, 2 services and 2 clients; it handles 30 messages and 10 calls, 5 of them"
            f" cancelled. Meanwhile the connections of ten permanent nodes are reset {found.resets:,} times."
            " Memory is the private memory of the process (anonymous pages) after the first sixth of the"
            " nodes; open files are counted before the first and after the last node."
        ),
        heading=["process", "start", "end", "growth per 1,000 nodes", "files, start", "end"],
        rows=rows,
        figures=figures,
        failures=failures,
    )
