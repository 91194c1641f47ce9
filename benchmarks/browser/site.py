"""A broker, nodes, a web server, and Chromium in front of it: what a measurement of the page needs."""

from __future__ import annotations

import asyncio
import json
import math
import shutil
from contextlib import AsyncExitStack
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

from benchmarks.browser.roles import EDGES
from benchmarks.faults.processes import ProcessGroup
from benchmarks.harness.errors import TrialError
from benchmarks.harness.processes import free_port

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.faults.processes import ControlledProcess

ROLES: Final = "benchmarks.browser.roles"
CROWD_PROCESSES: Final = 4
PER_SECOND: Final = 1000
"""Messages of the stream."""
LISTENING: Final = b"callboard web listening on "
ERROR_OF_MEDIAN: Final = 0.93
"""Times the distance of the quartiles, by the root of the number of values, if these are normal."""
READY_S: Final = 60.0
"""Limit for everything that a page is waited for."""
FLAGS: Final = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--enable-precise-memory-info",
)

DRAWN: Final = """vertices => new Promise(resolve => {
  const check = () => {
    const drawn = document.querySelector(".drawing[data-ready]");
    if (drawn && drawn._cyreg.cy.nodes().length >= vertices) {
      requestAnimationFrame(() => requestAnimationFrame(() => resolve(performance.now())));
    } else {
      requestAnimationFrame(check);
    }
  };
  check();
})"""
"""Resolves with the time since the navigation when a graph of so many vertices is laid out and painted.

Cytoscape leaves its instance at its element.
"""


class Memory(NamedTuple):
    """What a page holds after a collection of garbage."""

    heap_bytes: int
    nodes: int
    listeners: int


class Window:
    """A page of the browser, with its own cache and its debugging session."""

    def __init__(self, page: Any, session: Any, url: str) -> None:
        self.page = page
        self.session = session
        self._url = url
        self._errors: list[str] = []
        page.on("pageerror", self._add_error)

    def _add_error(self, error: object) -> None:
        self._errors.append(str(error))

    async def show(self, view: str) -> None:
        """Go to a view, such as `topic/%2Fstream`, within the page that is loaded."""
        await self.page.evaluate("address => { location.hash = address; }", f"#/{view}")

    async def load(self, view: str = "graph") -> None:
        """Load the page with this view."""
        await self.page.goto("about:blank")
        await self.page.goto(f"{self._url}#/{view}")

    async def drawn(self, vertices: int) -> float:
        """Wait until a graph of so many vertices is painted; return the ms since the navigation."""
        try:
            async with asyncio.timeout(READY_S):
                return float(await self.page.evaluate(DRAWN, vertices))
        except TimeoutError:
            raise TrialError(f"The graph is not painted after {READY_S:g} s. {self._errors}") from None

    async def memory(self) -> Memory:
        """Collect the page's garbage and return what is left."""
        await self.session.send("HeapProfiler.collectGarbage")
        found = (await self.session.send("Performance.getMetrics"))["metrics"]
        by_name = {each["name"]: int(each["value"]) for each in found}
        return Memory(by_name["JSHeapUsedSize"], by_name["Nodes"], by_name["JSEventListeners"])

    async def close(self) -> None:
        """Close the page, and forget its cache."""
        await self.page.context.close()


class Site(ProcessGroup):
    """The processes of a measurement, and a browser."""

    def __init__(self) -> None:
        super().__init__()
        self._browser: Any = None
        self._stack = AsyncExitStack()
        self._web_url = ""
        self.vertices = 0
        """Of the graph, without what comes and goes."""

    async def __aenter__(self) -> Self:
        """Start a broker."""
        await super().__aenter__()
        self.broker = await self.start_broker()
        return self

    async def __aexit__(self, *exc: object) -> None:
        """End everything."""
        await self._stack.aclose()
        await super().__aexit__(*exc)

    async def play(self, role: str, **parameters: object) -> ControlledProcess:
        """Start a process in a role of this package and wait until it is ready."""
        process = await self.play_at_once(role, **parameters)
        await process.wait_for_event("ready")
        return process

    async def play_at_once(self, role: str, **parameters: object) -> ControlledProcess:
        """Start a process in a role of this package."""
        parameters |= {"role": role, "url": self.url}
        return await self.start(role, ["-m", ROLES, json.dumps(parameters)])

    async def fill(self, total: int) -> None:
        """Start so many nodes in several processes, the node with the stream, and the web server."""
        share = -(-total // CROWD_PROCESSES)
        for first in range(0, total, share):
            await self.play("crowd", first=first, count=min(share, total - first))
        await self.play("stream", per_second=PER_SECOND)
        self.vertices = 2 * (total + 1)
        await self.web()

    async def web(self, *options: str) -> str:
        """Start the web server; return its address."""
        listen = ["--listen", f"127.0.0.1:{free_port()}", "--no-browser", "--url", self.url, *options]
        self.server = await self.start("web", ["-m", "actors", "web", *listen])
        while not (line := await self.server.read_line()).startswith(LISTENING):
            pass
        self._web_url = line.removeprefix(LISTENING).decode().strip()
        return self._web_url

    async def window(self) -> Window:
        """Open an empty page with an empty cache."""
        context = await (await self._chromium()).new_context(viewport={"width": 1280, "height": 800})
        page = await context.new_page()
        page.set_default_timeout(1000 * READY_S)
        session = await context.new_cdp_session(page)
        await session.send("Performance.enable")
        await session.send("Network.enable")
        return Window(page, session, self._web_url)

    async def _chromium(self) -> Any:
        if self._browser is None:
            playwright: Any = import_module("playwright.async_api")
            driver = await self._stack.enter_async_context(playwright.async_playwright())
            path = shutil.which("chromium") or shutil.which("chromium-browser")
            self._browser = await driver.chromium.launch(executable_path=path, args=list(FLAGS))
            self._stack.push_async_callback(self._browser.close)
        return self._browser


def edges(nodes: int) -> int:
    """Return how many edges so many nodes have."""
    return EDGES * nodes


def percent(ratios: Sequence[float]) -> list[str]:
    """Return median, with its standard error, and quartiles of ratios as differences from 1, in percent."""
    middle, lower, upper = (100 * (each - 1) for each in quartiles(ratios))
    return [f"{middle:+.1f} ± {100 * error(ratios):.1f} %", f"{lower:+.1f} %", f"{upper:+.1f} %"]


def quartiles(values: Sequence[float]) -> tuple[float, float, float]:
    """Return the median, the lower quartile and the upper one."""
    ordered = sorted(values)
    middle, lower, upper = (ordered[round(part * (len(ordered) - 1))] for part in (0.5, 0.25, 0.75))
    return middle, lower, upper


def error(values: Sequence[float]) -> float:
    """Return the standard error of the median."""
    _, lower, upper = quartiles(values)
    return ERROR_OF_MEDIAN * (upper - lower) / math.sqrt(len(values))
