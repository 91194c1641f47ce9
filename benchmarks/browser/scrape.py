"""How long `/metrics` takes with many topics."""

from __future__ import annotations

import asyncio
import time
from typing import Final
from urllib.request import urlopen

from benchmarks.browser.site import Site
from benchmarks.faults.figures import Section, milliseconds

TOPICS: Final = 1000
PAUSE_S: Final = 0.5
"""Between two scrapes: the broker collects its statistics during an eighth of its time only."""


async def measure(scrapes: int) -> tuple[list[float], int]:
    """Return the seconds of each scrape, and the bytes of the last one."""
    times: list[float] = []
    size = 0
    async with Site() as site:
        await site.play("topics", count=TOPICS)
        url = await site.web() + "metrics"
        for _ in range(scrapes):
            began = time.perf_counter()
            size = len(await asyncio.to_thread(_read, url))
            times.append(time.perf_counter() - began)
            await asyncio.sleep(PAUSE_S)
    return times, size


def _read(url: str) -> bytes:
    with urlopen(url, timeout=10.0) as answer:
        body: bytes = answer.read()
    return body


def section(times: list[float], size: int) -> Section:
    """Return the table."""
    found = milliseconds(times)
    return Section(
        key="scrape",
        title=f"GET /metrics, {TOPICS} topics, in ms",
        text="A new connection for each.",
        heading=["scrapes", "p50", "p95", "max", "KiB"],
        rows=[
            [
                str(found["count"]),
                *(f"{found[key]:.1f}" for key in ("p50_ms", "p95_ms", "max_ms")),
                f"{size / 1024:.0f}",
            ]
        ],
        figures={**found, "bytes": size},
    )
