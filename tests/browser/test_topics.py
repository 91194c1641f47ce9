"""Topics, their messages and plots in a browser."""

from __future__ import annotations

import asyncio
import re
from typing import TYPE_CHECKING, Any

from playwright.async_api import expect

import actors
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.std_msgs.msg import Int32, String
from tests.actors.meeting import latched
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.browser.conftest import Site

AXES_FIT = """() => {
    const [, red] = /(\\d+)/.exec(getComputedStyle(document.querySelector("main .dim")).color);
    const canvas = document.querySelector(".plot canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.some((value, index) => index % 4 === 0 && data[index + 3] === 255 && value === Number(red));
}"""
"""Says whether a plot's axes have the color that faint texts have now."""


async def test_echo_shows_live_messages_and_pauses(site: Site) -> None:
    """The text of the publisher, then another one, and none while it is paused."""
    page = await site.open("topic", "/addison")
    field = page.locator(".tree div").filter(has_text="data:")
    await field.wait_for()
    first = await field.inner_text()
    assert "Hi Automatic Addison" in first
    async with asyncio.timeout(DEADLINE_SEC):
        while await field.inner_text() == first:
            await page.wait_for_timeout(20)
    await page.get_by_role("button", name="Pause").click()
    held = await field.inner_text()
    published = site.programs["minimal_publisher"]
    await published.wait_for_line("Publishing")
    await published.wait_for_line("Publishing")
    assert await field.inner_text() == held


async def test_one_of_several_types_is_chosen(empty_site: Site, stack: AsyncExitStack) -> None:
    """For the messages that are shown, and for the one that is published."""
    publishers: list[Any] = []
    for name, kind in (("texts", String), ("numbers", Int32)):
        node = await stack.enter_async_context(actors.Node(name, url=empty_site.system.url))
        publishers.append(node.create_publisher(kind, "mixed", latched(1)))
    heard: asyncio.Queue[Any] = asyncio.Queue()
    node.create_subscription(Int32, "mixed", heard.put_nowait)
    publishers[0].publish(String(data="a text"))
    page = await empty_site.open("topic", "/mixed")
    tree = page.locator(".tree")
    await tree.get_by_text("a text").wait_for()
    await page.get_by_label("Type").select_option("std_msgs/msg/Int32")
    publishers[1].publish(Int32(data=17))
    await tree.get_by_text("17").wait_for()
    await page.get_by_text("Publish a message").click()
    await page.get_by_label("data").fill("8")
    await page.get_by_role("button", name="Publish", exact=True).click()
    await page.locator(".notice", has_text="Published on /mixed").wait_for()
    async with asyncio.timeout(DEADLINE_SEC):
        while (await heard.get()).data != 8:
            pass


async def test_a_number_is_plotted_and_downloaded(empty_site: Site, stack: AsyncExitStack) -> None:
    """Chosen in the topic's tree; the CSV file has the points."""
    node = await stack.enter_async_context(actors.Node("wave", url=empty_site.system.url))
    publisher = node.create_publisher(Twist, "wave", 10)
    count = 0

    def publish() -> None:
        nonlocal count
        message = Twist()
        message.linear.x = float(count)
        publisher.publish(message)
        count += 1

    node.create_timer(0.02, publish)
    page = await empty_site.open("topic", "/wave")
    await page.get_by_label("Plot linear.x").click()
    await page.get_by_text("Open the plot").click()
    plot = page.locator(".plot[data-points]")
    async with asyncio.timeout(DEADLINE_SEC):
        while int(await plot.get_attribute("data-points") or 0) <= 20:
            await page.wait_for_timeout(20)
    async with page.expect_download() as download:
        await page.get_by_role("button", name="CSV").click()
    head, *rows = (await (await download.value).path()).read_text(encoding="utf-8").splitlines()
    assert head == '"time","/wave linear.x"'
    values = [float(row.split(",")[1]) for row in rows]
    assert values == [values[0] + number for number in range(len(values))]


async def test_a_plot_takes_the_colors_of_another_theme(empty_site: Site) -> None:
    """Its axes are dark on light ground, then light on dark ground."""
    page = await empty_site.open("plot", color_scheme="light")
    await page.locator(".plot canvas").wait_for()
    for theme in ("light", "dark"):
        await page.evaluate("theme => { document.documentElement.dataset.theme = theme; }", theme)
        async with asyncio.timeout(DEADLINE_SEC):
            while not await page.evaluate(AXES_FIT):
                await page.wait_for_timeout(20)


async def test_delays_are_measured_on_demand(site: Site) -> None:
    """Nobody reads the topics of the list before."""
    page = await site.open("topics")
    row = page.locator("tbody tr").filter(has=page.get_by_role("link", name="/addison", exact=True))
    delay = row.locator("td").nth(6)
    await row.wait_for()
    assert await delay.inner_text() == "-"
    await page.get_by_label("Measure delays").check()
    await delay.filter(has_text=re.compile("[µm]?s$")).wait_for()
    await page.get_by_label("Measure delays").uncheck()
    await delay.filter(has_text=re.compile("^-$")).wait_for()


async def test_the_list_of_topics_is_filtered_and_sorted(site: Site) -> None:
    """By a part of a name; by a click on a heading."""
    page = await site.open("topics")
    names = page.locator("tbody tr td:first-child")
    await names.filter(has_text="/addison2").wait_for()
    await page.get_by_label("Filter").fill("addison")
    assert await names.all_inner_texts() == ["/addison", "/addison2"]
    await page.get_by_role("button", name="Topic", exact=True).click()
    assert await names.all_inner_texts() == ["/addison2", "/addison"]


async def test_a_long_table_shows_all_rows_when_asked(empty_site: Site, stack: AsyncExitStack) -> None:
    """At first the first ones, in the chosen order."""
    node = await stack.enter_async_context(actors.Node("many", url=empty_site.system.url))
    for number in range(210):
        node.create_publisher(Twist, f"topic_{number:03}", 10)
    page = await empty_site.open("topics")
    more = page.get_by_role("button", name="Show all")
    await more.wait_for()
    rows = page.locator("tbody tr")
    await expect(rows).to_have_count(200)
    await page.get_by_role("button", name="Topic", exact=True).click()
    await expect(rows.filter(has_text="/topic_209")).to_have_count(1)
    await more.click()
    await rows.nth(210).wait_for()
    assert not await more.is_visible()
