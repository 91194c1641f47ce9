"""How long the page takes to show the graph, and how much of it goes over the wire."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Final

from benchmarks.browser.site import Site
from benchmarks.faults.figures import Section

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.browser.site import Window

EXAMPLES: Final = Path(__file__).resolve().parents[2] / "examples"
DEMO: Final = (
    "add_two_ints_server",
    "minimal_publisher",
    "minimal_subscriber",
    "publishing_subscriber",
    "fibonacci_action_server",
)
DEMO_VERTICES: Final = 7
"""Five nodes and two topics."""
VIEWS: Final = {
    "topics": "Topics",
    "topic/%2Fstream": "/stream",
    "plot": "Plot",
    "nodes": "Nodes",
    "node/%2Fstreamer": "/streamer",
    "services": "Services",
    "service/%2Fstreamer%2Fget_parameters": "/streamer/get_parameters",
    "actions": "Actions",
    "action/%2Fnone": "/none",
    "log": "Log",
}
"""All but the first, with their titles."""
TARGET_KIB: Final = 400
"""Of all files of the page over the wire."""


@dataclass
class Loads:
    """Of one graph: ms from the navigation until it is painted, and bytes over the wire."""

    cold: list[float] = field(default_factory=list[float])
    warm: list[float] = field(default_factory=list[float])
    cold_bytes: list[int] = field(default_factory=list[int])
    warm_bytes: list[int] = field(default_factory=list[int])

    async def add(self, site: Site, vertices: int) -> None:
        """Load the page with an empty cache, and once more."""
        window = await site.window()
        for times, sizes in ((self.cold, self.cold_bytes), (self.warm, self.warm_bytes)):
            requests = _requests(window)
            await window.load()
            times.append(await window.drawn(vertices))
            sizes.append(await _wire_bytes(requests))
        await window.close()


def _requests(window: Window) -> list[Any]:
    """Return a list that grows by each request of the page and its workers."""
    found: list[Any] = []

    def add(request: Any) -> None:
        found.append(request)

    window.page.on("requestfinished", add)
    return found


async def _wire_bytes(requests: list[Any]) -> int:
    """Return the size of the responses, as they were sent."""
    total = 0
    for request in requests:
        sizes = await request.sizes()
        total += sizes["responseHeadersSize"] + sizes["responseBodySize"]
    return total


@dataclass
class Loading:
    """The times by graph, and the bytes of all views."""

    graphs: dict[str, Loads]
    whole_bytes: int = 0


async def measure(rounds: int, nodes: int) -> Loading:
    """Load the demo's graph and a large one, and visit all views once."""
    demo, many = Loads(), Loads()
    async with Site() as site:
        for example in DEMO:
            await site.start(example, [str(EXAMPLES / f"{example}.py")])
        await site.web()
        for _ in range(rounds):
            await demo.add(site, DEMO_VERTICES)
    async with Site() as site:
        await site.fill(nodes)
        for _ in range(rounds):
            await many.add(site, site.vertices)
        window = await site.window()
        requests = _requests(window)
        await window.load()
        await window.drawn(site.vertices)
        for view, title in VIEWS.items():
            await window.show(view)
            await window.page.wait_for_function("title => document.title.startsWith(title)", arg=title)
        return Loading({"the demo": demo, f"{nodes} nodes": many}, await _wire_bytes(requests))


def section(found: Loading) -> Section:
    """Return the table; a page that is too large is a failure."""
    whole_kib = found.whole_bytes / 1024
    rows = [
        [graph, *(f"{text(times):.0f}" for times in (loads.cold, loads.warm) for text in (median, max))]
        + [f"{median(sizes) / 1024:.1f}" for sizes in (loads.cold_bytes, loads.warm_bytes)]
        for graph, loads in found.graphs.items()
    ]
    return Section(
        key="loading",
        title="from the navigation to the painted graph, in ms; responses over the wire, in KiB",
        text="Cold: with an empty cache. Warm: the browser asks for each file whether it has changed.",
        heading=["graph", "cold p50", "max", "warm p50", "max", "cold KiB", "warm KiB"],
        rows=[*rows, ["all views", *["-"] * 4, f"{whole_kib:.1f}", "-"]],
        figures={"whole_kib": whole_kib, **{graph: _figures(loads) for graph, loads in found.graphs.items()}},
        failures=[f"the page has {whole_kib:.0f} KiB, the limit is {TARGET_KIB}"] * (whole_kib > TARGET_KIB),
    )


def _figures(loads: Loads) -> Mapping[str, Any]:
    return {"cold_ms": loads.cold, "warm_ms": loads.warm, "cold_kib": median(loads.cold_bytes) / 1024}
