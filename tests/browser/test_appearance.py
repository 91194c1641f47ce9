"""How the page looks, on small screens, for everybody, and with hostile data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest

from tests.browser.conftest import OVERFLOW
from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from tests.browser.conftest import Site

SCHEMES: Final = ("light", "dark")
VIEWS = (
    "graph",
    "topics",
    "topic//addison",
    "plot",
    "nodes",
    "node//minimal_publisher",
    "services",
    "actions",
    "log",
)
PACKAGES = ROOT / "build" / "npm" / "node_modules"
AXE = PACKAGES / "axe-core" / "axe.min.js"
VENDOR = ROOT / "actors" / "web" / "assets" / "vendor"


@pytest.mark.parametrize("scheme", SCHEMES)
async def test_both_color_schemes_have_their_colors(site: Site, scheme: str) -> None:
    """Dark text on light ground, or light text on dark ground."""
    page = await site.open(color_scheme=scheme)
    red = "color => Number(/\\d+/.exec(color)[0])"
    ground = await page.evaluate(f"({red})(getComputedStyle(document.body).backgroundColor)")
    text = await page.evaluate(f"({red})(getComputedStyle(document.body).color)")
    assert (ground > text) == (scheme == "light")


async def test_nothing_is_wider_than_a_phone(site: Site) -> None:
    """360 pixels, in every view; tables scroll by themselves, and the menu to where one is."""
    page = await site.open()
    await page.set_viewport_size({"width": 360, "height": 740})
    for view in VIEWS:
        kind, _, name = view.partition("/")
        await site.go(page, kind, name)
        await page.locator("main h2").wait_for(state="attached")
        await page.wait_for_timeout(300)
        assert await page.evaluate(OVERFLOW) == "", view
        current = page.locator("nav [aria-current]")
        assert await current.evaluate("link => link.getBoundingClientRect().right") <= 360, view


async def test_axe_finds_no_serious_violation(site: Site) -> None:
    """In every view, in both color schemes."""
    page = await site.open()
    await page.evaluate(AXE.read_text(encoding="utf-8"))
    for view in VIEWS:
        kind, _, name = view.partition("/")
        await site.go(page, kind, name)
        await page.locator("main h2").wait_for(state="attached")
        await page.wait_for_timeout(300)
        for scheme in SCHEMES:
            await page.emulate_media(color_scheme=scheme)
            found = await page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
            serious = [
                (each["id"], each["nodes"][0]["html"][:200])
                for each in found["violations"]
                if each["impact"] in {"serious", "critical"}
            ]
            assert serious == [], (view, scheme)


async def test_views_say_that_there_is_nothing(empty_site: Site) -> None:
    """Until there is something."""
    page = await empty_site.open()
    await page.get_by_text("There are no nodes.").wait_for()
    for view in ("topics", "nodes", "services", "actions"):
        await empty_site.go(page, view)
        await page.get_by_text(f"No {view} are shown.").wait_for()
    await empty_site.system.example("minimal_publisher")
    await empty_site.go(page, "nodes")
    await page.get_by_role("link", name="/minimal_publisher").wait_for()
    assert not await page.get_by_text("No nodes are shown.").is_visible()


def test_libraries_are_those_of_their_packages() -> None:
    """Without comments that name source maps."""
    for path in (each for each in VENDOR.iterdir() if each.suffix in {".js", ".mjs", ".css"}):
        (original,) = [*PACKAGES.glob(f"*/dist/{path.name}"), *PACKAGES.glob(f"@*/*/dist/{path.name}")]
        text = original.read_text(encoding="utf-8")
        lines = [line for line in text.splitlines(keepends=True) if "sourceMappingURL" not in line]
        assert path.read_text(encoding="utf-8") == "".join(lines), path.name
