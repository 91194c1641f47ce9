"""Images of topics in a browser."""

from __future__ import annotations

import asyncio
import re
from base64 import b64decode
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image
from tests.actors.meeting import latched
from tests.actors.web.image_data import png_of
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from playwright.async_api import Page

    from tests.browser.conftest import Site

RED, GREEN, BLUE = [255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]
WHITE = [255] * 4

PIXELS = """() => {
  const canvas = document.querySelector(".image canvas");
  if (!canvas || canvas.hidden) return [];
  return [...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data];
}"""


async def camera(site: Site, stack: AsyncExitStack, kind: Any = Image) -> Any:
    """Return a publisher whose last message reaches everybody."""
    node = await stack.enter_async_context(actors.Node("camera", url=site.system.url))
    return node.create_publisher(kind, "camera", latched(1))


def raw(encoding: str, *pixels: str, width: int = 0) -> Image:
    """Return an image of a row of pixels, each in hexadecimal; `width` repeats the row."""
    data = bytes.fromhex("".join(pixels)) * max(width, 1)
    size = len(pixels) * max(width, 1)
    return Image(encoding=encoding, width=size, height=1, step=len(data), data=data)


async def until_drawn(page: Page, *pixels: list[int]) -> None:
    """Wait until the canvas has these pixels."""
    wanted = [each for pixel in pixels for each in pixel]
    async with asyncio.timeout(DEADLINE_SEC):
        while await page.evaluate(PIXELS) != wanted:
            await page.wait_for_timeout(20)


async def test_pixels_are_drawn_and_replaced(empty_site: Site, stack: AsyncExitStack) -> None:
    """In their colors, whatever the encoding; with size and encoding for readers of the screen, too."""
    publisher = await camera(empty_site, stack)
    publisher.publish(raw("rgb8", "ff0000", "0000ff"))
    page = await empty_site.open("topic", "/camera")
    await until_drawn(page, RED, BLUE)
    await page.get_by_role("img", name=re.compile("2 . 1, rgb8")).wait_for()
    publisher.publish(raw("bgra8", "00ff0000"))
    await until_drawn(page, GREEN)
    publisher.publish(raw("mono8", "80"))
    await until_drawn(page, [128, 128, 128, 255])
    publisher.publish(raw("mono16", "00ff"))
    await until_drawn(page, WHITE)
    await page.get_by_text("mono16 ·").wait_for()


async def test_files_are_drawn(empty_site: Site, stack: AsyncExitStack) -> None:
    """JPEG and PNG, by their content; nothing else, such as SVG, which could have scripts."""
    publisher = await camera(empty_site, stack, CompressedImage)
    publisher.publish(CompressedImage(format="jpeg", data=png_of(1, 1, 2, b"\0\xff\0\0")))
    page = await empty_site.open("topic", "/camera")
    await until_drawn(page, RED)
    url = await page.evaluate("""() => {
      const canvas = document.createElement("canvas");
      canvas.width = canvas.height = 16;
      return canvas.toDataURL("image/jpeg");
    }""")
    publisher.publish(CompressedImage(format="png", data=b64decode(url.partition(",")[2])))
    await until_drawn(page, *[[0, 0, 0, 255]] * 256)
    assert empty_site.problems == []
    publisher.publish(CompressedImage(format="png", data=b"<svg xmlns='http://www.w3.org/2000/svg'/>"))
    await page.get_by_text("neither a JPEG nor a PNG file").wait_for()
    publisher.publish(CompressedImage(data=png_of(1, 1, 2, b"broken")[:60]))
    await page.get_by_text("The browser cannot draw this image/png file").wait_for()
    publisher.publish(CompressedImage(data=png_of(1, 1, 2, b"\0\0\xff\0")))
    await until_drawn(page, GREEN)
    assert all("422" in each for each in empty_site.problems)
    empty_site.problems.clear()


async def test_a_paused_image_stays(empty_site: Site, stack: AsyncExitStack) -> None:
    """The page does not even ask for others; the newest is there when it goes on."""
    publisher = await camera(empty_site, stack)
    publisher.publish(raw("rgb8", "ff0000"))
    page = await empty_site.open()
    async with page.expect_request(re.compile("/image\\?after=[1-9]")):
        await empty_site.go(page, "topic", "/camera")
    await until_drawn(page, RED)
    async with page.expect_event("requestfailed"):
        await page.get_by_role("button", name="Pause").click()
    publisher.publish(raw("rgb8", "0000ff"))
    await page.get_by_role("button", name="Pause").click()
    await until_drawn(page, BLUE)


async def test_a_wide_image_fits_a_narrow_page(empty_site: Site, stack: AsyncExitStack) -> None:
    """All of it, without a bar to scroll."""
    (await camera(empty_site, stack)).publish(raw("mono8", "80", width=2000))
    page = await empty_site.open("topic", "/camera")
    await page.set_viewport_size({"width": 360, "height": 700})
    await page.get_by_role("img", name=re.compile("2000 . 1")).wait_for()
    box = await page.locator(".image canvas").bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 360
    assert await page.evaluate("document.documentElement.scrollWidth <= innerWidth")
