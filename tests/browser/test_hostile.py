"""What strangers may write is only text: nothing of it runs, loads, or breaks the page's layout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from playwright.async_api import expect

import actors
from actors.interfaces.callboard_interfaces.msg import CallbackTimes
from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.lifecycle_msgs.msg import State, Transition, TransitionDescription
from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions, GetState
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.browser.conftest import OVERFLOW
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from playwright.async_api import Page

    from tests.browser.conftest import Site

MARK = "<img src=x onerror=alert(1)>"
HOSTILE = f"{MARK}<script>alert(2)</script>\u2066 \u0000\u001b[2J __proto__ javascript:alert(3) \u202egnp "
LONG = HOSTILE + "x" * 10_000
DIRECTIONS = """selector => [...new Set([...document.querySelectorAll(selector)].map((element) => {
    const [first, second] = [0, 1].map((start) => {
        const range = new Range();
        range.setStart(element.firstChild, start);
        range.setEnd(element.firstChild, start + 1);
        return range.getBoundingClientRect();
    });
    return first.left < second.left ? "ltr" : "rtl";
}))]"""
"""In which directions the first letters of elements are written."""
HALF_A_PAIR = """
import actors

class Half(actors.Node):
    def __init__(self):
        super().__init__("half")
        self.get_logger().error("half a pair \\ud800")

actors.run(Half)
"""
"""In a process of its own, as pytest's reports cannot have a surrogate."""
LATCHED = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
NAMES = ("__proto__", "constructor", "hasOwnProperty", "toString", HOSTILE, "x" * 10_000)


class Inherited(actors.Message):
    """Fields whose names are members that JavaScript's objects inherit."""

    constructor: str = HOSTILE
    hasOwnProperty: str = HOSTILE  # noqa: N815
    toString: str = LONG  # noqa: N815
    valueOf: int = 5  # noqa: N815


class Evil(actors.Node):
    """A node that tells hostile texts wherever it may tell a text.

    Args:
        url: The broker.
    """

    def __init__(self, url: str) -> None:
        super().__init__("evil", url=url, start_diagnostics_service=False)
        for name in NAMES:
            self.declare_parameter(name, LONG, describe())
        for number, value in enumerate((HOSTILE, LONG, [HOSTILE, LONG])):
            self.declare_parameter(f"p{number}", value, describe())
        self.create_publisher(String, "text", LATCHED).publish(String(data=LONG))
        self.create_publisher(Inherited, "inherited", LATCHED).publish(Inherited())
        self.create_service(GetDiagnostics, "~/get_diagnostics", self.on_diagnostics)
        self.create_service(GetState, "~/get_state", self.on_state)
        self.create_service(GetAvailableTransitions, "~/get_available_transitions", self.on_transitions)
        self.create_service(Trigger, "answer", lambda _: Trigger.Response(success=True, message=LONG))
        self.create_service(Trigger, "fail", self.on_fail)
        self.create_action_server(Fibonacci, "goal", self.on_goal)

    def log(self) -> None:
        """Write lines, also some that no logger writes."""
        self.get_logger().error(LONG)
        lines = self.create_publisher(Log, "/rosout", LATCHED)
        lines.publish(Log(name=LONG, msg=HOSTILE, file=HOSTILE, function=LONG, level=77))

    def on_diagnostics(self, _: GetDiagnostics.Request) -> GetDiagnostics.Response:
        """Tell of a hostile host and of callbacks."""
        names = (HOSTILE, LONG, "__proto__", "constructor")
        callbacks = [CallbackTimes(name=name, kind=name, source=name, calls=1) for name in names]
        return GetDiagnostics.Response(host=LONG, pid=1, uptime_sec=1.0, callbacks=callbacks)

    def on_state(self, _: GetState.Request) -> GetState.Response:
        """Tell of a hostile state."""
        return GetState.Response(current_state=State(id=1, label=LONG))

    def on_transitions(self, _: GetAvailableTransitions.Request) -> GetAvailableTransitions.Response:
        """Tell of hostile transitions."""
        state = State(id=1, label=HOSTILE)
        labels = (HOSTILE, LONG)
        return GetAvailableTransitions.Response(
            available_transitions=[
                TransitionDescription(
                    transition=Transition(id=number, label=label), start_state=state, goal_state=state
                )
                for number, label in enumerate(labels)
            ]
        )

    def on_fail(self, _: Trigger.Request) -> Trigger.Response:
        """Raise."""
        raise ValueError(LONG)

    async def on_goal(self, _: Any) -> Fibonacci.Result:
        """Raise."""
        raise ValueError(LONG)


def describe() -> actors.ParameterDescriptor:
    """Return a hostile description."""
    return actors.ParameterDescriptor(description=LONG, additional_constraints=HOSTILE)


async def assert_harmless(page: Page) -> None:
    """Hold the page against what hostile texts might do; `problems` has dialogs, errors and requests."""
    assert await page.locator("main img, main script, main a[href^=javascript]").count() == 0
    for width in (360, 1200):
        await page.set_viewport_size({"width": width, "height": 800})
        assert await page.evaluate(OVERFLOW) == "", width


async def test_messages_and_the_log_are_only_text(empty_site: Site, stack: AsyncExitStack) -> None:
    """Also in fields whose names objects of JavaScript inherit, and in lines that no logger writes."""
    node = await stack.enter_async_context(Evil(empty_site.system.url))
    node.log()
    half = await empty_site.system.python("-c", HALF_A_PAIR)
    # The page waits for less time than a process may need to start.
    await half.wait_for_line("half a pair")
    assert await node.wait_for_node("/half", DEADLINE_SEC), half.output
    page = await empty_site.open("topic", "/text")
    await page.locator(".tree").get_by_text(MARK).wait_for()
    await assert_harmless(page)
    await empty_site.go(page, "topic", "/inherited")
    await page.locator(".tree").get_by_text("toString").wait_for()
    await assert_harmless(page)
    await empty_site.go(page, "log")
    await page.get_by_text("Level 77").wait_for()
    await page.get_by_text("half a pair \\ud800").wait_for()
    await expect(page.locator(".log-line").filter(has_text=MARK)).to_have_count(2)
    await assert_harmless(page)


async def test_what_a_node_tells_of_itself_is_only_text(empty_site: Site, stack: AsyncExitStack) -> None:
    """Its parameters, host, callbacks and states; a text's direction changes no text beside it."""
    await stack.enter_async_context(Evil(empty_site.system.url))
    page = await empty_site.open("node", "/evil")
    names = page.locator("form.parameter label")
    await names.filter(has_text="__proto__").first.wait_for()
    shown = await names.all_inner_texts()
    assert {"__proto__", "constructor", "toString", "p0", "x" * 10_000} <= set(shown)
    await page.get_by_text("host <img").wait_for()
    await page.get_by_role("cell", name="constructor", exact=True).first.wait_for()
    await page.get_by_text("State: <img").wait_for()
    assert await page.evaluate(DIRECTIONS, ".parameter-text > :nth-child(2):not(:empty)") == ["ltr"]
    await assert_harmless(page)


async def test_answers_and_errors_are_only_text(empty_site: Site, stack: AsyncExitStack) -> None:
    """Of a service and of an action."""
    await stack.enter_async_context(Evil(empty_site.system.url))
    page = await empty_site.open("service", "/answer")
    await page.get_by_role("button", name="Call", exact=True).click()
    await page.locator(".tree").get_by_text(MARK).wait_for()
    await assert_harmless(page)
    await empty_site.go(page, "service", "/fail")
    await page.get_by_role("button", name="Call", exact=True).click()
    await page.locator(".notice.bad").filter(has_text=MARK).wait_for()
    await assert_harmless(page)
    await empty_site.go(page, "action", "/goal")
    await page.get_by_role("button", name="Send the goal").click()
    await page.get_by_text("ABORTED").first.wait_for()
    await assert_harmless(page)
    assert len(empty_site.problems) == 1
    assert "502" in empty_site.problems.pop()  # the browser logs the answer to the call that failed
