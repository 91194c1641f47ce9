"""The graph in a browser."""

from __future__ import annotations

import asyncio
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import actors
from tests.browser.conftest import Site
from tests.integration.conftest import DEADLINE_SEC, free_port
from tests.integration.mesh.stations import MeshBroker

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AsyncExitStack

    from playwright.async_api import Browser, Page

    from tests.integration.conftest import System

READY = ".drawing[data-ready]"
REMOVAL = """name => {
    const list = document.querySelector(".graph details ul");
    const isGone = () => ![...list.children].some((item) => item.textContent === name);
    return { time: new Promise((resolve) => {
        const observer = new MutationObserver(() => isGone() && resolve(performance.now()));
        observer.observe(list, { childList: true });
    }) };
}"""
"""When an entry is removed from the list, which is written together with the drawing."""


async def listed(page: Page) -> set[str]:
    """Return what is drawn, from the list beside the drawing."""
    items = await page.locator(".graph details li").all_inner_texts()
    return {" ".join(item.split()) for item in items}


async def until_listed(page: Page, *expected: str, gone: str = "") -> None:
    """Wait until these are drawn, and the other one is not."""
    async with asyncio.timeout(DEADLINE_SEC):
        while not (set(expected) <= (found := await listed(page)) and gone not in found):
            await page.wait_for_timeout(20)


async def test_the_graph_shows_nodes_and_arrows(site: Site) -> None:
    """And the details of what is selected."""
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


async def test_a_killed_node_disappears(site: Site, record_property: Callable[[str, object], None]) -> None:
    """Soon: the page's clock measures from before the SIGKILL until the page has removed it."""
    page = await site.open()
    await page.get_by_text("As a list").click()
    await until_listed(page, *(f"node /{name}" for name in site.programs))
    for name, program in site.programs.items():
        removal = await page.evaluate_handle(REMOVAL, f"node /{name}")
        start = await page.evaluate("performance.now()")
        await program.kill()
        async with asyncio.timeout(DEADLINE_SEC):
            end = await page.evaluate("removal => removal.time", removal)
        record_property(f"SIGKILL of /{name} until the page has removed it", f"{end - start:.0f} ms")


async def test_services_and_actions_are_drawn_on_demand(site: Site) -> None:
    """And namespaces as groups, which a click folds."""
    page = await site.open()
    await page.get_by_text("As a list").click()
    await page.get_by_label("Services").check()
    await page.get_by_label("Actions").check()
    await until_listed(page, "service /add_two_ints", "action /fibonacci")


async def test_an_unknown_view_is_the_graph(empty_site: Site) -> None:
    """Also if an object of JavaScript has a member of that name."""
    page = await empty_site.open("topics")
    await page.get_by_role("heading", name="Topics").wait_for()
    await empty_site.go(page, "constructor")
    await page.locator(".graph").wait_for()


async def test_the_filter_draws_when_typing_ends(site: Site) -> None:
    """Only what matches and its neighbours; leaving the view before that is no error."""
    page = await site.open()
    await page.wait_for_selector(READY)
    field = page.get_by_label("Filter by name")
    await field.press_sequentially("addison2")
    shown = "() => document.querySelector('.drawing')._cyreg.cy.nodes().map(node => node.id()).sort()"
    async with asyncio.timeout(DEADLINE_SEC):
        while await page.evaluate(shown) != ["node /publishing_subscriber", "topic /addison2"]:
            await page.wait_for_timeout(20)
    await field.press("Backspace")
    await site.go(page, "log")
    await page.get_by_role("heading", name="Log").wait_for()
    await site.go(page, "graph")
    await page.wait_for_selector(READY)


LAY_OUT = """async ({ count, blocks }) => {
  const { layOut } = await import(new URL("js/layout.js", document.baseURI));
  const ids = [...Array(count).keys()];
  const boxes = ids.map(number => ({ id: `${number}`, width: 100, height: 30, block: `${number % blocks}` }));
  const steps = [1, blocks, 7 * blocks];
  const edges = ids.flatMap(number => steps.map(step => [`${number}`, `${(number + step) % count}`]));
  return [...layOut(boxes, edges)].map(([id, { x, y }]) => [Number(id), x, y]);
}"""
"""Lay out a circle, in which each vertex also has arrows to others of its block."""


async def test_a_large_graph_is_laid_out_whatever_its_shape(empty_site: Site) -> None:
    """Also a circle of a thousand: no vertex covers another, and the whole is not much wider than tall."""
    page = await empty_site.open()
    found = await page.evaluate(LAY_OUT, {"count": 1000, "blocks": 1})
    assert sorted(number for number, _, _ in found) == list(range(1000))
    places = sorted((x, y) for _, x, y in found)
    assert all(
        right - left >= 100 or abs(below - above) >= 30 for (left, above), (right, below) in pairwise(places)
    )
    assert (max(x for _, x, _ in found) - min(x for _, x, _ in found)) < 4 * max(y for _, _, y in found)


async def test_namespaces_of_a_large_graph_are_apart(empty_site: Site) -> None:
    """Each has an area of its own."""
    page = await empty_site.open()
    found = await page.evaluate(LAY_OUT, {"count": 200, "blocks": 4})
    areas: list[tuple[float, float, float, float]] = []
    for block in range(4):
        xs = [x for number, x, _ in found if number % 4 == block]
        ys = [y for number, _, y in found if number % 4 == block]
        areas.append((min(xs), max(xs), min(ys), max(ys)))
    for one, other in combinations(areas, 2):
        assert one[1] < other[0] or other[1] < one[0] or one[3] < other[2] or other[3] < one[2]


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


async def test_nodes_of_a_mesh_are_shown_with_their_brokers(
    system: System, browser: Browser, stack: AsyncExitStack
) -> None:
    """In the list of nodes and in the graph; there is no such column before the second broker has joined."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    site = Site(system, browser)
    await system.broker("--mesh-listen", endpoint, "--mesh-name", "alpha", "--insecure")
    await site.start_web()
    await stack.enter_async_context(actors.Node("here", url=system.url))
    page = await site.open("nodes")
    rows = page.locator("tbody tr")
    await rows.filter(has_text="/here").wait_for()
    assert "Broker" not in await page.locator("thead").inner_text()
    beta = await MeshBroker(system, [endpoint]).start("--mesh-name", "beta")
    await stack.enter_async_context(actors.Node("there", url=beta.url))
    await page.locator("thead").get_by_text("Broker").wait_for()
    await rows.filter(has_text="/there").filter(has_text="beta").wait_for()
    await rows.filter(has_text="/here").filter(has_text="alpha").wait_for()
    await site.go(page, "graph")
    await page.get_by_text("As a list").click()
    await page.get_by_role("button", name="/there").click()
    await page.get_by_role("complementary", name="Details").get_by_text("on beta").wait_for()
    assert site.problems == []
