"""A real browser in front of a real server: Chromium, driven by Playwright. Run by `make web-test`."""

from __future__ import annotations

import shutil
import sys
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

import pytest
import pytest_asyncio
from playwright.async_api import async_playwright, expect

from tests.fork_server import client
from tests.integration.conftest import System

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from playwright.async_api import Browser, ConsoleMessage, Page, Playwright

    from tests.integration.conftest import Program

WAIT_MS: Final = 20_000
"""How long a page is waited for: also on a busy machine."""
expect.set_options(timeout=WAIT_MS)

OVERFLOW: Final = """() => ["html", "main"].filter((tag) => {
    const element = document.querySelector(tag);
    return element.scrollWidth > element.clientWidth;
}).join()"""
"""Says what of the page scrolls to the side."""

CHROMIUM: Final = shutil.which("chromium") or shutil.which("chromium-browser") or "chromium"
FLAGS: Final = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
    "--no-first-run",
)

COURSE: Final = (
    "add_two_ints_server",
    "minimal_publisher",
    "minimal_subscriber",
    "publishing_subscriber",
    "fibonacci_action_server",
)
"""The examples that run: five nodes, two topics, a service and an action."""


class Site:
    """A broker, the examples, a web server, and browsers that look at it.

    Args:
        system: Starts processes.
        browser: Opens pages.

    Attributes:
        url: The page's address, with the token.
        broker: Its process.
        web: The web server's.
        programs: The examples' processes by name.
        problems: What pages have logged as errors, and requests to other servers.
    """

    def __init__(self, system: System, browser: Browser) -> None:
        self.system = system
        self.url = ""
        self.programs: dict[str, Program] = {}
        self.problems: list[str] = []
        self._browser = browser

    async def start(self, *examples: str) -> None:
        """Start everything."""
        self.broker = await self.system.broker()
        for name in examples:
            self.programs[name] = await self.system.example(name)
        await self.start_web()

    async def start_web(self, port: int = 0) -> None:
        """Start the web server, at a free port unless one is given."""
        listen = ("--listen", f"127.0.0.1:{port}", "--allow-control", "--no-browser")
        self.web = await self.system.program(sys.executable, "-m", "actors", "web", *listen)
        line = await self.web.wait_for_line("callboard web listening on ")
        self.url = line.rpartition(" ")[2]

    async def open(self, view: str = "", name: str = "", **options: Any) -> Page:
        """Open the page in a new context, such as `open("topic", "/addison")`.

        Args:
            view: The view; empty for the first.
            name: What of it is shown.
            options: Of the browser's context, such as `color_scheme`.
        """
        options.setdefault("viewport", {"width": 1200, "height": 800})
        context = await self._browser.new_context(**options)
        page = await context.new_page()
        page.set_default_timeout(WAIT_MS)
        page.on("pageerror", lambda error: self.problems.append(str(error)))
        page.on("console", self._check_line)
        page.on("dialog", lambda dialog: self.problems.append(f"a dialog: {dialog.message}"))
        page.on("request", lambda request: self._check(request.url))
        await page.goto(self.url)
        if view:
            await self.go(page, view, name)
        return page

    async def go(self, page: Page, view: str, name: str = "") -> None:
        """Go to another view."""
        await page.evaluate("address => { location.hash = address; }", f"#/{view}/{quote(name, safe='')}")

    def _check_line(self, line: ConsoleMessage) -> None:
        if line.type == "error":
            self.problems.append(line.text)

    def _check(self, url: str) -> None:
        if not url.startswith((self.url.partition("#")[0], "data:", "blob:")):
            self.problems.append(f"a request to {url}")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that takes the pictures for the documents."""
    parser.addoption("--screenshots", action="store_true", help="write the pictures to docs/images")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests have measured."""
    for report in terminalreporter.stats.get("passed", []):
        for name, value in report.user_properties:
            terminalreporter.write_line(f"{name}: {value}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the tests of the page on one event loop, which is that of their browser; fork web servers."""
    client.MODULES.append("actors.web.server")
    folder = Path(__file__).parent
    for item in items:
        if folder in item.path.parents and pytest_asyncio.is_async_test(item):
            item.add_marker(pytest.mark.asyncio(loop_scope="session"), append=False)


class Chromium:
    """The browser that the tests of a worker share: starting one takes a second of CPU.

    Args:
        playwright: Starts it.
    """

    def __init__(self, playwright: Playwright) -> None:
        self._playwright = playwright
        self._running: Browser | None = None

    async def running(self) -> Browser:
        """Return it; another one if it has ended."""
        if self._running is None or not self._running.is_connected():
            launch = self._playwright.chromium.launch
            self._running = await launch(executable_path=CHROMIUM, args=list(FLAGS))
        return self._running

    async def close(self) -> None:
        """End it."""
        if self._running is not None:
            await self._running.close()


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def chromium() -> AsyncIterator[Chromium]:
    """What tests of this worker share."""
    async with async_playwright() as playwright:
        shared = Chromium(playwright)
        yield shared
        await shared.close()


@pytest_asyncio.fixture(loop_scope="session")
async def browser(chromium: Chromium) -> AsyncIterator[Browser]:
    """Chromium, without anything of other tests."""
    running = await chromium.running()
    try:
        yield running
    finally:
        for context in running.contexts:
            await context.close()


@pytest_asyncio.fixture(loop_scope="session")
async def system() -> AsyncIterator[System]:
    """A starter of processes, which ends them on the tests' loop; no broker runs yet."""
    processes = System()
    try:
        yield processes
    finally:
        await processes.close()


@pytest_asyncio.fixture(loop_scope="session")
async def stack() -> AsyncIterator[AsyncExitStack]:
    """Leaves nodes at the end, after sites have been held against their problems."""
    async with AsyncExitStack() as entered:
        yield entered


@pytest_asyncio.fixture(loop_scope="session")
async def empty_site(system: System, browser: Browser, stack: AsyncExitStack) -> AsyncIterator[Site]:
    """A broker and a web server; no page may log an error."""
    site = Site(system, browser)
    await site.start()
    yield site
    assert site.problems == []


@pytest_asyncio.fixture(loop_scope="session")
async def site(system: System, browser: Browser, stack: AsyncExitStack) -> AsyncIterator[Site]:
    """The same with the examples."""
    site = Site(system, browser)
    await site.start(*COURSE)
    yield site
    assert site.problems == []
