"""What an open page costs the broker: its throughput with one, and without."""

from __future__ import annotations

import json
from statistics import median
from typing import TYPE_CHECKING, Final, NamedTuple

from benchmarks.browser.site import Site, error, percent
from benchmarks.faults.figures import Section
from benchmarks.harness import meters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.browser.site import Window
    from benchmarks.faults.processes import ControlledProcess

SIZE: Final = 256
"""Of a message, in bytes."""
SECONDS: Final = 3.0
"""Of a round."""
TARGET: Final = 0.95
"""Of the throughput without a page."""


class Round(NamedTuple):
    """One round.

    Attributes:
        rate: Messages per second.
        cpu_us: The broker's CPU time per message.
    """

    rate: float
    cpu_us: float


async def measure(rounds: int, nodes: int) -> list[tuple[Round, Round]]:
    """Return rounds without a page and with one, in pairs: which comes first alternates."""
    pairs: list[tuple[Round, Round]] = []
    async with Site() as site:
        await site.fill(nodes)
        windows = [await site.window() for _ in range(2)]
        for number in range(rounds):
            found: dict[bool, Round] = {}
            for shown in (number % 2 == 0, number % 2 == 1):
                await _show(windows, site.vertices, shown=shown)
                found[shown] = await _round(site)
            pairs.append((found[False], found[True]))
    return pairs


async def _show(windows: Sequence[Window], vertices: int, *, shown: bool) -> None:
    """Show the graph, and the echo of the stream; or nothing."""
    graph, topic = windows
    if not shown:
        for window in windows:
            await window.page.goto("about:blank")
        return
    await topic.load("topic/%2Fstream")
    await topic.page.locator(".tree div").first.wait_for()
    await graph.load()
    await graph.drawn(vertices)


async def _round(site: Site) -> Round:
    """Let a publisher send to a subscriber as fast as it can."""
    subscriber = await _role(site, "subscriber", subscriptions=1)
    publisher = await _role(site, "publisher", readers=1)
    before_s = meters.cpu_s(site.broker.pid) or 0.0
    for process in (subscriber, publisher):
        await process.send_command("go")
    await publisher.wait_for_event("done")
    figures = await subscriber.wait_for_event("done")
    used_s = (meters.cpu_s(site.broker.pid) or 0.0) - before_s
    for process in (subscriber, publisher):
        await site.stop(process)
    return Round(figures["rate"], 1e6 * used_s / figures["received"])


async def _role(site: Site, role: str, **parameters: object) -> ControlledProcess:
    given = {"role": role, "url": site.url, "size": SIZE, "seconds": SECONDS, **parameters}
    process = await site.start(role, ["-m", "benchmarks.harness", json.dumps(given)])
    await process.wait_for_event("ready")
    return process


def section(pairs: Sequence[tuple[Round, Round]]) -> Section:
    """Return the table; a page that costs too much, by more than the error of the median, is a failure."""
    without, shown = zip(*pairs, strict=True)
    rates = [after.rate / before.rate for before, after in pairs]
    cpu = [after.cpu_us / before.cpu_us for before, after in pairs]
    rows = [
        [name, f"{median(each.rate for each in found):,.0f}", f"{median(each.cpu_us for each in found):.2f}"]
        for name, found in (("without a page", without), ("with graph and echo open", shown))
    ]
    return Section(
        key="throughput",
        title=f"one publisher, one subscriber, {SIZE} B; {len(pairs)} pairs of rounds",
        text="Ratios are those of the two rounds of a pair: the median, and the quartiles.",
        heading=["", "messages/s", "broker's CPU us"],
        rows=[
            *rows,
            *(
                [name, *(texts[number] for texts in (percent(rates), percent(cpu)))]
                for number, name in enumerate(("ratio", "lower quartile", "upper quartile"))
            ),
        ],
        figures={"pairs": [[each._asdict() for each in pair] for pair in pairs], "rates": rates, "cpu": cpu},
        failures=[f"the throughput is {median(rates):.3f} of that without a page, the limit is {TARGET}"]
        * (median(rates) + error(rates) < TARGET),
    )
