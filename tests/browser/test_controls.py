"""Calls, goals, parameters and the log in a browser."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import SetBool
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.browser.conftest import Site


async def test_the_form_of_add_two_ints_answers_8(site: Site) -> None:
    """Five and three, typed into the form made from the type."""
    page = await site.open("service", "/add_two_ints")
    await page.get_by_label("a int64").fill("5")
    await page.get_by_label("b int64").fill("3")
    await page.get_by_role("button", name="Call", exact=True).click()
    await page.get_by_text("sum: 8").wait_for()


async def test_one_of_several_types_of_a_service_is_chosen(empty_site: Site, stack: AsyncExitStack) -> None:
    """The form is that of the chosen type, and its server is called."""
    for name, kind in (("adder", AddTwoInts), ("switch", SetBool)):
        node = await stack.enter_async_context(actors.Node(name, url=empty_site.system.url))
        node.create_service(kind, "mixed", lambda _, response: response)
    page = await empty_site.open("service", "/mixed")
    await page.get_by_label("Type").select_option("std_srvs/srv/SetBool")
    await page.get_by_label("data bool").check()
    await page.get_by_role("button", name="Call", exact=True).click()
    await page.get_by_text("success: false").wait_for()
    assert all("400" in each for each in empty_site.problems)  # no form before the choice
    empty_site.problems.clear()


async def test_a_goal_shows_feedback_and_is_cancelled(site: Site) -> None:
    """Feedback grows until the goal is cancelled."""
    page = await site.open("action", "/fibonacci")
    await page.get_by_label("order int32").fill("40")
    await page.get_by_role("button", name="Send the goal").click()
    await page.get_by_text("[0, 1, 1, 2").first.wait_for()
    await page.get_by_role("button", name="Cancel", exact=False).last.click()
    await page.get_by_text("CANCELED").first.wait_for()


async def test_a_parameter_is_changed(site: Site) -> None:
    """And the node has the new value."""
    page = await site.open("node", "/minimal_publisher")
    box = page.get_by_label("use_sim_time")
    await box.wait_for()
    assert not await box.is_checked()
    await box.check()
    await (
        page.locator("form.parameter")
        .filter(has_text="use_sim_time")
        .get_by_role("button", name="Set")
        .click()
    )
    command = ("-m", "actors", "param", "get", "/minimal_publisher", "use_sim_time", "--hide-type")
    async with asyncio.timeout(DEADLINE_SEC):
        while True:
            asked = await site.system.python(*command)
            await asked.wait_for_exit()
            if "True" in asked.output or "true" in asked.output:
                break


async def test_the_log_is_filtered(site: Site) -> None:
    """By a node, and by a part of the text."""
    page = await site.open("log")
    lines = page.get_by_text("Publishing:")
    await lines.first.wait_for()
    await page.get_by_placeholder("Part of the text").fill("I heard")
    await page.get_by_text("I heard").first.wait_for()
    async with asyncio.timeout(DEADLINE_SEC):
        while await lines.count():
            await page.wait_for_timeout(20)
