"""The page while it is hidden, without a broker and without its server: it says so, and goes on by itself."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import String
from tests.browser.test_graph import listed, until_listed
from tests.integration.conftest import wait_for_subscriptions
from tests.waiting import DEADLINE_SEC

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from playwright.async_api import Page

    from tests.browser.conftest import Site

LIVE = "#status:not(.lost)"
OPEN = "found => found.forEach((each) => { each.open = true; })"


async def set_hidden(page: Page, *, hidden: bool) -> None:
    """Let a page believe that it is hidden, or seen again: without a screen each page is seen."""
    await page.evaluate(
        """hidden => {
            Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
            document.dispatchEvent(new Event("visibilitychange"));
        }""",
        hidden,
    )


async def test_a_hidden_page_costs_nothing_and_is_current_when_it_is_seen_again(
    empty_site: Site, stack: AsyncExitStack
) -> None:
    """Its connection ends, and with it the server's subscription; the page then shows what came meanwhile."""
    node = await stack.enter_async_context(actors.Node("talker", url=empty_site.system.url))
    latched = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = node.create_publisher(String, "chatter", latched)
    publisher.publish(String(data="first"))
    page = await empty_site.open("topic", "/chatter")
    await page.locator(".tree").get_by_text("first").wait_for()
    await wait_for_subscriptions(publisher)
    await set_hidden(page, hidden=True)
    await wait_for_subscriptions(publisher, 0)
    await page.locator("#status.lost").wait_for()
    publisher.publish(String(data="second"))
    await set_hidden(page, hidden=False)
    await page.locator(".tree").get_by_text("second").wait_for()
    await page.locator(LIVE).wait_for()


async def test_the_page_goes_on_after_a_restart_of_the_broker(site: Site) -> None:
    """It says that there is no broker; then the nodes are there again, and messages come."""
    page = await site.open("topic", "/addison")
    text = page.locator(".tree").get_by_text("Hi Automatic Addison")
    await text.wait_for()
    await site.broker.kill()
    await page.get_by_text(f"no broker at {site.system.url}").wait_for()
    held = await text.inner_text()
    site.broker = await site.system.broker()
    await page.locator(LIVE).wait_for()
    await page.locator(".tree").get_by_text("Hi Automatic Addison").filter(has_not_text=held).wait_for()
    await site.go(page, "graph")
    await page.get_by_text("As a list").click()
    await until_listed(page, *[f"node /{name}" for name in site.programs])


async def test_the_page_goes_on_after_a_restart_of_the_web_server(site: Site) -> None:
    """It says that what it shows is old, and goes on by itself."""
    page = await site.open()
    await page.get_by_text("As a list").click()
    await until_listed(page, "topic /addison")
    port = int(site.url.split("#")[0].rstrip("/").rpartition(":")[2])
    await site.web.kill()
    await page.locator("#status.lost").wait_for()
    await site.start_web(port)
    await page.locator(LIVE).wait_for()
    # With another token the view begins anew, without control, maybe after the list was opened.
    async with asyncio.timeout(DEADLINE_SEC):
        while "topic /addison" not in await listed(page):
            await page.locator(".graph details").evaluate_all(OPEN)
            await page.wait_for_timeout(20)
    site.problems.clear()  # the browser logs each attempt to connect
