"""Memory of a broker and of a process of nodes while nodes come and go as fast as they can."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.faults.figures import Section, slope
from benchmarks.faults.puppet import Theatre

HOUR: Final = 3600
"""Lives: one a second for an hour."""
SAMPLES: Final = 36
WARM_UP: Final = 1 / 6
"""Part of the lives after which caches, free lists and the allocator's heap have their size."""
FLAT_KIB: Final = 1024
"""Growth that still counts as flat, of either process, in an hour's worth of lives."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """Samples of lives, memory (KiB) and open files by process; how long it took; links that were reset."""

    lives: int
    resets: int
    seconds: float
    samples: list[dict[str, Any]]


async def measure(lives: int = HOUR) -> Found:
    """Live so many lives."""
    async with Theatre() as theatre:
        broker = await theatre.broker()
        began = time.monotonic()
        churn = await theatre.play("churn", lives=lives, samples=SAMPLES, broker_pid=broker.pid)
        samples = [await churn.hears("sample")]
        while samples[-1]["lives"] < lives:
            samples.append(await churn.hears("sample"))
        seconds = time.monotonic() - began
        resets = (await churn.hears("done"))["resets"]
        return Found(lives=lives, resets=resets, seconds=seconds, samples=samples)


def section(found: Found) -> Section:
    """Return the table of memory; a failure if it grows."""
    warm = [sample for sample in found.samples if sample["lives"] >= WARM_UP * found.lives]
    rows: list[list[str]] = []
    figures: dict[str, Any] = {
        "lives": found.lives,
        "resets": found.resets,
        "seconds": found.seconds,
        "samples": found.samples,
    }
    failures: list[str] = []
    for who in ("broker", "nodes"):
        # The last sample is of another state: all broken links are up again.
        memory = [(float(sample["lives"]), float(sample["memory_kib"][who])) for sample in warm[:-1]]
        start, end = memory[0][1], memory[-1][1]
        per_1000 = 1000 * slope(memory)
        files = [found.samples[0]["files"][who], found.samples[-1]["files"][who]]
        rows.append(
            [
                who,
                *(f"{kib / 1024:.1f} MiB" for kib in (start, end)),
                f"{per_1000:+,.0f} KiB",
                *map(str, files),
            ]
        )
        figures[who] = {"start_kib": start, "end_kib": end, "kib_per_1000_lives": per_1000, "files": files}
        if files[1] > files[0]:
            failures.append(f"{who}: {files[1] - files[0]} files are left open")
        if per_1000 * HOUR / 1000 > FLAT_KIB:
            failures.append(f"the memory of {who} grows: {per_1000:+,.0f} KiB per 1,000 lives")
    return Section(
        key="churn",
        title="nodes come and go",
        text=(
            f"{found.lives:,} lives in {found.seconds:.0f} s: as many as one a second for"
            f" {found.lives / HOUR:g} h. Each life is a node with a link of its own, 3 latched publishers and"
            " 3 subscriptions, 2 services and 2 clients, 30 messages and 10 calls, 5 of them cancelled."
            f" Meanwhile the links of ten nodes that stay are reset {found.resets:,} times. Memory is"
            " what is the process's own (anonymous pages), from a sixth of the lives on; open files are"
            " counted before the first and after the last life."
        ),
        heading=["process", "start", "end", "growth per 1,000 lives", "files, start", "end"],
        rows=rows,
        figures=figures,
        failures=failures,
    )
