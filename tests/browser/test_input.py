"""What somebody writes, or has the focus on, survives what arrives meanwhile."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

from playwright.async_api import expect

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from playwright.async_api import Route

    from tests.browser.conftest import Site

FORM = "**/form"
TABLE = """async () => {
    const { Table } = await import("/js/table.js");
    const table = new Table("Rates", [
        { title: "Rate", value: (row) => row.rate, number: true },
        { title: "Name", value: (row) => row.name, href: (row) => `#${row.name}` },
    ]);
    document.body.append(table.element);
    table.show({ a: { name: "a", rate: 2 }, b: { name: "b", rate: 1 }, c: { name: "c", rate: 0 } });
    table.element.querySelector("tr a").focus();
    table.show({ a: { name: "a", rate: 0 }, b: { name: "b", rate: 1 }, c: { name: "c", rate: 2 } });
    return [document.activeElement.textContent, table.element.querySelector("tbody").textContent];
}"""
CHILDREN = """async () => {
    const { h, setChildren } = await import("/js/dom.js");
    const place = document.body.appendChild(h("div"));
    const content = (rate) => [h("p", {}, rate), null, h("button", {}, "neighbour")];
    setChildren(place, ...content("1 message/s"), h("p", {}, "more"));
    place.querySelector("button").focus();
    setChildren(place, ...content("2 messages/s"));
    return [document.activeElement.textContent, place.innerHTML];
}"""


async def test_a_form_keeps_its_values_when_another_client_comes(
    empty_site: Site, stack: AsyncExitStack
) -> None:
    """Of a service and of an action: the type is the same."""
    node = await stack.enter_async_context(actors.Node("server", url=empty_site.system.url))
    node.create_service(AddTwoInts, "add", lambda _, response: response)
    node.create_action_server(Fibonacci, "count", lambda _: Fibonacci.Result())
    service, action = await empty_site.open("service", "/add"), await empty_site.open("action", "/count")
    await service.get_by_label("a int64").fill("5")
    await action.get_by_label("order int32").fill("6")
    other = await stack.enter_async_context(actors.Node("other", url=empty_site.system.url))
    async with service.expect_response(FORM), action.expect_response(FORM):
        other.create_client(AddTwoInts, "add")
        other.create_action_client(Fibonacci, "count")
    for page in (service, action):
        await page.get_by_role("link", name="/other").wait_for()
        await page.get_by_role("button", name="As JSON").click()
    assert json.loads(await service.get_by_label("JSON").input_value())["a"] == 5
    assert json.loads(await action.get_by_label("JSON").input_value())["order"] == 6


async def test_a_parameter_is_what_was_sent_while_somebody_writes_on(
    empty_site: Site, stack: AsyncExitStack
) -> None:
    """The answer is about the value that was sent, and leaves the field alone."""
    node = await stack.enter_async_context(actors.Node("motor", url=empty_site.system.url))
    node.declare_parameter("speed", 5)
    page = await empty_site.open("node", "/motor")
    field = page.get_by_label("speed")

    async def write_on(route: Route) -> None:
        await field.fill("78")
        await route.continue_()

    await page.route("**/parameters", write_on)
    await field.fill("7")
    async with page.expect_response("**/parameters"):
        await field.press("Enter")
    await page.get_by_text(re.compile("(Set to|has become) 7")).first.wait_for()
    assert await page.get_by_text("Set to 78").count() == 0
    await expect(field).to_have_value("78")
    await expect(page.get_by_role("button", name="Set", exact=True).first).to_be_enabled()
    assert node.get_parameter("speed").value == 7


async def test_integers_of_a_sequence_are_set_exactly(empty_site: Site, stack: AsyncExitStack) -> None:
    """Also those that JavaScript's numbers cannot hold."""
    node = await stack.enter_async_context(actors.Node("motor", url=empty_site.system.url))
    node.declare_parameter("ids", [1])
    page = await empty_site.open("node", "/motor")
    field = page.get_by_label("ids")
    await field.fill(f"[{2**53 + 1}, {2**63 - 1}]")
    await field.press("Enter")
    await page.get_by_text("Set to [").first.wait_for()
    await expect(field).to_have_value("[9007199254740993,9223372036854775807]")
    assert node.get_parameter("ids").value == [2**53 + 1, 2**63 - 1]


async def test_a_token_counts_in_a_page_that_is_open_already(empty_site: Site) -> None:
    """The printed address differs in its fragment only, so that the browser loads nothing."""
    page = await empty_site.open()
    await expect(page.locator("#status")).to_contain_text("live")  # it has signed in, which keeps the token
    await page.evaluate("sessionStorage.clear()")
    address, _, token = empty_site.url.partition("#")
    await page.goto(address)
    await page.reload()
    assert await page.evaluate("sessionStorage.length") == 0
    async with page.expect_response("**/api/session"):
        await page.goto(f"{address}#{token}")
    await page.wait_for_function("sessionStorage.length == 1 && !location.hash")


async def test_a_view_that_cannot_be_loaded_is_an_error_that_is_shown(empty_site: Site) -> None:
    """Such as while the server restarts; another view is not affected."""
    page = await empty_site.open()
    await page.route("**/views/log.js", lambda route: route.abort())
    await empty_site.go(page, "log")
    await page.get_by_text("This view cannot be loaded").wait_for()
    await empty_site.go(page, "nodes")
    await page.get_by_role("heading", name="Nodes").wait_for()
    empty_site.problems.clear()  # the browser logs the failure


async def test_the_focus_stays_when_rows_move_and_neighbours_change(empty_site: Site) -> None:
    """On the link of a row, and on what an update leaves as it is."""
    page = await empty_site.open()
    assert await page.evaluate(TABLE) == ["a", "2c1b0a"]
    assert await page.evaluate(CHILDREN) == ["neighbour", "<p>2 messages/s</p><button>neighbour</button>"]
