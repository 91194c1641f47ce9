"""How long the page takes from an input to the next paint, with a large graph and a fast topic shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from benchmarks.browser.site import PER_SECOND, Site, edges
from benchmarks.faults.figures import Section, milliseconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.browser.site import Window

TARGET_MS: Final = 100
"""Of the 95th percentile of each kind of input."""
PAUSE_MS: Final = 130
"""Between two inputs; no multiple of the period of anything."""
CLICKED: Final = 5
"""Every so-manieth vertex is clicked."""
ZOOM_STEP: Final = 120
ZOOM_STEPS: Final = 12
"""In one direction."""
DRAG_STEP: Final = 12
TEXT: Final = "robot_12"

WATCH: Final = """() => {
  window.times = {};
  window.blocked = [];
  for (const name of ["click", "keydown", "wheel", "mousemove"]) {
    addEventListener(name, event => {
      const began = event.timeStamp;
      requestAnimationFrame(() => {
        const channel = new MessageChannel();
        channel.port1.onmessage = () => (window.times[name] ??= []).push(performance.now() - began);
        channel.port2.postMessage(null);
      });
    }, { capture: true, passive: true });
  }
  new PerformanceObserver(list => list.getEntries().forEach(each => window.blocked.push(each.duration)))
    .observe({ type: "longtask" });
}"""
"""Takes the time of each input, as the browser received it, until the task after the next frame; and how long
each task of more than 50 ms took."""

PLACES: Final = """step => {
  const area = document.querySelector(".drawing");
  const { left, top } = area.getBoundingClientRect();
  return area._cyreg.cy.nodes().filter((_, number) => number % step === 0).map(node => {
    const { x, y } = node.renderedPosition();
    return [left + x, top + y];
  });
}"""
"""Returns where vertices are on the screen."""

Times = dict[str, list[float]]


async def measure(inputs: int, nodes: int) -> tuple[Times, Times]:
    """Do each kind of input so many times.

    Returns:
        The ms until the next paint by kind of input, and the long tasks by view.
    """
    async with Site() as site:
        await site.fill(nodes)
        graph, topic, topics = [await site.window() for _ in range(3)]
        await topics.load("topics")
        await topics.page.locator("td").first.wait_for()
        await topic.load("topic/%2Fstream")
        await topic.page.locator(".tree").get_by_text("linear_acceleration").first.wait_for()
        await graph.load()
        await graph.drawn(site.vertices)
        windows = {"graph": graph, "topic": topic, "topics": topics}
        for window in windows.values():
            await window.page.evaluate(WATCH)
        empty = await site.window()
        await empty.page.evaluate(WATCH)
        times = {
            "an empty page: click": await _click(empty, [(100.0, 100.0)], inputs),
            "graph: click on a node": await _click_nodes(graph, inputs),
            "graph: type in the filter": await _filter(graph, inputs),
            "graph: zoom": await _zoom(graph, inputs),
            "graph: move": await _drag(graph, inputs),
            "topic: pause the echo": await _press(topic, ["Pause"], inputs),
            "topics: sort": await _press(topics, ["Messages/s", "Topic", "Bytes/s"], inputs),
        }
        return times, {name: await window.page.evaluate("window.blocked") for name, window in windows.items()}


async def _taken(window: Window, event: str) -> list[float]:
    """Return the times of a kind of event, and forget all."""
    await window.page.wait_for_timeout(PAUSE_MS)
    found: Times = await window.page.evaluate("window.times")
    await window.page.evaluate("window.times = {}")
    return found[event]


async def _click(window: Window, places: Sequence[tuple[float, float]], inputs: int) -> list[float]:
    for number in range(inputs):
        await window.page.mouse.click(*places[number % len(places)])
        await window.page.wait_for_timeout(PAUSE_MS)
    return await _taken(window, "click")


async def _click_nodes(window: Window, inputs: int) -> list[float]:
    """Click on one after the other, which shows its details beside the drawing."""
    for number in range(inputs + 1):
        places = await window.page.evaluate(PLACES, CLICKED)
        await window.page.mouse.click(*places[number % len(places)])
        await window.page.wait_for_timeout(PAUSE_MS)
        if not number:  # the drawing has become smaller
            await window.page.evaluate("window.times = {}")
    return await _taken(window, "click")


async def _filter(window: Window, inputs: int) -> list[float]:
    await window.page.get_by_label("Filter by name").focus()
    keys = [*TEXT, *["Backspace"] * len(TEXT)]
    for number in range(inputs):
        await window.page.keyboard.press(keys[number % len(keys)])
        await window.page.wait_for_timeout(PAUSE_MS)
    found = await _taken(window, "keydown")
    await window.page.get_by_label("Filter by name").fill("")
    return found


async def _zoom(window: Window, inputs: int) -> list[float]:
    await window.page.mouse.move(600, 400)
    for number in range(inputs):
        inwards = number // ZOOM_STEPS % 2 == 0
        await window.page.mouse.wheel(0, -ZOOM_STEP if inwards else ZOOM_STEP)
        await window.page.wait_for_timeout(PAUSE_MS)
    return await _taken(window, "wheel")


async def _drag(window: Window, inputs: int) -> list[float]:
    """Move the drawing with the mouse, beginning where nothing is."""
    await window.page.get_by_role("button", name="Fit").click()
    area = await window.page.locator(".drawing").bounding_box()
    x, y = area["x"] + 6, area["y"] + 6
    await window.page.mouse.move(x, y)
    await window.page.mouse.down()
    for number in range(inputs):
        await window.page.mouse.move(x + DRAG_STEP * (number % ZOOM_STEPS + 1), y + number % 2)
        await window.page.wait_for_timeout(PAUSE_MS)
    await window.page.mouse.up()
    return await _taken(window, "mousemove")


async def _press(window: Window, names: list[str], inputs: int) -> list[float]:
    """Click on buttons, twice on each in turn."""
    buttons = [window.page.get_by_role("button", name=name, exact=True) for name in names]
    boxes = [await button.bounding_box() for button in buttons]  # now: looking for them takes the page long
    places = [(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) for box in boxes for _ in range(2)]
    return await _click(window, places, inputs)


def section(times: Times, blocked: Times, nodes: int) -> Section:
    """Return the table; a kind of input whose 95th percentile is too long is a failure."""
    figures = {kind: milliseconds([each / 1000 for each in found]) for kind, found in times.items()}
    longest = {view: max(found, default=0.0) for view, found in blocked.items()}
    return Section(
        key="interaction",
        title=(
            f"from an input to the next paint, in ms: {nodes} nodes with {edges(nodes)} edges in one page, "
            f"{PER_SECOND} messages/s echoed in another"
        ),
        text="From the event's time stamp to the task after the next frame.",
        heading=["input", "count", "p50", "p95", "max"],
        rows=[
            [kind, f"{found['count']}", *(f"{found[key]:.0f}" for key in ("p50_ms", "p95_ms", "max_ms"))]
            for kind, found in figures.items()
        ]
        + [
            [f"{view}: tasks of more than 50 ms", f"{len(found)}", "", "", f"{longest[view]:.0f}"]
            for view, found in blocked.items()
        ],
        figures={**figures, "long_tasks": blocked},
        failures=[
            f"{kind}: {found['p95_ms']:.0f} ms (p95), the limit is {TARGET_MS}"
            for kind, found in figures.items()
            if found["p95_ms"] >= TARGET_MS
        ],
    )
