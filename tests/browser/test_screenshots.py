"""The pictures of the page in the documents: `make web-test PYTEST_FLAGS=--screenshots` takes them anew."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.geometry_msgs.msg import Twist
from tests.browser.test_graph import READY
from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from playwright.async_api import Page

    from tests.browser.conftest import Site

FOLDER = ROOT / "docs" / "images"
RATE_HZ = 25.0


async def save(page: Page, name: str) -> None:
    """Save what a page shows now."""
    FOLDER.mkdir(exist_ok=True)
    await page.screenshot(path=FOLDER / f"{name}.png", animations="disabled", caret="hide")


def add_turtle(driver: actors.Node, simulator: actors.Node) -> None:
    """Let a node drive in curves, and another one listen."""
    publisher = driver.create_publisher(Twist, "cmd_vel", 10)
    simulator.create_subscription(Twist, "cmd_vel", lambda _: None, 10)
    ticks = 0

    def drive() -> None:
        nonlocal ticks
        message = Twist()
        message.linear.x = 1.5 + 0.5 * math.sin(ticks / RATE_HZ)
        message.angular.z = math.cos(ticks / RATE_HZ / 2)
        publisher.publish(message)
        ticks += 1

    driver.create_timer(1 / RATE_HZ, drive)


async def test_screenshots(site: Site, stack: AsyncExitStack, pytestconfig: pytest.Config) -> None:
    """Of the views that the documents show."""
    if not pytestconfig.getoption("screenshots"):
        pytest.skip("only with --screenshots")
    url = site.system.url
    nodes = [actors.Node(name, namespace="/turtle1", url=url) for name in ("driver", "simulator")]
    add_turtle(*[await stack.enter_async_context(node) for node in nodes])
    for name, scheme in (("web-graph", "light"), ("web-graph-dark", "dark")):
        page = await site.open(color_scheme=scheme)
        await page.set_viewport_size({"width": 1100, "height": 620})
        await page.get_by_label("Services").check()
        await page.get_by_label("Actions").check()
        await page.get_by_label("Namespaces").check()
        await page.wait_for_selector(READY)
        await page.wait_for_timeout(2000)  # until the rates have come
        await page.get_by_role("button", name="Lay out").click()
        await page.wait_for_timeout(1000)
        await save(page, name)

    page = await site.open("topic", "/turtle1/cmd_vel")
    await page.set_viewport_size({"width": 1100, "height": 760})
    await page.get_by_label("Plot linear.x").click()
    await page.get_by_label("Plot angular.z").click()
    await page.get_by_text("messages/s").wait_for()
    await save(page, "web-topic")
    await site.go(page, "plot")
    await page.get_by_label("Length of the window").select_option("10 s")
    async with asyncio.timeout(DEADLINE_SEC):
        while int(await page.locator(".plot").get_attribute("data-points") or 0) < 11 * RATE_HZ:
            await page.wait_for_timeout(50)
    await save(page, "web-plot")
    await site.go(page, "node", "/minimal_publisher")
    await page.get_by_role("heading", name="Process").wait_for()
    await page.get_by_label("use_sim_time").wait_for()
    await page.wait_for_timeout(2000)
    await save(page, "web-node")

    page = await site.open("topics", viewport={"width": 360, "height": 480})
    await page.get_by_role("link", name="/turtle1/cmd_vel").wait_for()
    await page.wait_for_timeout(2000)
    await save(page, "web-phone")
