"""The graph in a browser."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from playwright.async_api import Page

    from tests.browser.conftest import Site

READY = ".drawing[data-ready]"


async def listed(page: Page) -> set[str]:
    """Return what is drawn, from the list beside the drawing."""
    items = await page.locator(".graph details li").all_inner_texts()
    return {" ".join(item.split()) for item in items}


async def until_listed(page: Page, *expected: str, gone: str = "") -> None:
    """Wait until these are drawn, and the other one is not."""
    async with asyncio.timeout(DEADLINE_SEC):
        while not (set(expected) <= (found := await listed(page)) and gone not in found):
            await page.wait_for_timeout(20)


async def test_the_graph_shows_nodes_and_arrows_and_what_is_killed_disappears(site: Site) -> None:
    """A node that is killed, as soon as its connection has ended."""
    page = await site.open()
    await page.wait_for_selector(READY)
    await page.get_by_text("As a list").click()
    nodes = [f"node /{name}" for name in site.programs]
    await until_listed(page, *nodes, "topic /addison", "topic /addison2")
    await page.get_by_role("button", name="/addison", exact=True).click()
    details = page.get_by_role("complementary", name="Details")
    assert await details.get_by_role("listitem").all_inner_texts() == [
        "publishes: /minimal_publisher",
        "subscribes: /minimal_subscriber",
        "subscribes: /publishing_subscriber",
    ]
    await site.programs["minimal_publisher"].kill()
    await until_listed(page, gone="node /minimal_publisher")


async def test_services_and_actions_are_drawn_on_demand(site: Site) -> None:
    """And namespaces as groups, which a click folds."""
    page = await site.open()
    await page.get_by_text("As a list").click()
    await page.get_by_label("Services").check()
    await page.get_by_label("Actions").check()
    await until_listed(page, "service /add_two_ints", "action /fibonacci")


async def test_a_drawing_can_be_saved(site: Site) -> None:
    """As SVG, with the names in it, and as PNG."""
    page = await site.open()
    await page.wait_for_selector(READY)
    async with page.expect_download() as svg:
        await page.get_by_role("button", name="SVG").click()
    text = (await (await svg.value).path()).read_text(encoding="utf-8")
    assert text.startswith("<svg")
    assert "/minimal_publisher" in text
    async with page.expect_download() as png:
        await page.get_by_role("button", name="PNG").click()
    assert (await (await png.value).path()).read_bytes().startswith(b"\x89PNG")


async def test_the_page_recovers_from_a_restart_of_the_web_server(site: Site) -> None:
    """It says that what it shows is old, and goes on by itself."""
    page = await site.open()
    await page.get_by_text("As a list").click()
    await until_listed(page, "topic /addison")
    port = int(site.url.split("#")[0].rstrip("/").rpartition(":")[2])
    await site.web.kill()
    await page.locator("#status.lost").wait_for()
    await site.start_web(port)
    await page.locator("#status:not(.lost)").wait_for()
    await page.get_by_text("As a list").click()  # with another token the view begins anew, without control
    await until_listed(page, "topic /addison")
    site.problems.clear()  # the browser logs each attempt to connect
