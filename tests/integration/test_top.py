"""`callboard top` as a process."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT
from tests.integration.terminal import on_terminal

if TYPE_CHECKING:
    from tests.integration.conftest import System


async def test_once_prints_topics_and_nodes(system: System) -> None:
    """It prints a topic with its publisher, and exits with 0."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.wait_for_line("Publishing")
    top = await system.python("-m", "actors", "top", "--once", "--interval", "0.1")
    assert await top.wait_for_exit() == 0
    assert re.search(r"^/addison +1 +0 .*std_msgs/msg/String$", top.output, re.MULTILINE)
    assert re.search(r"^/minimal_publisher +linked", top.output, re.MULTILINE)


async def test_the_program_in_the_guide_runs(system: System) -> None:
    """It prints each topic's rate."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.wait_for_line("Publishing")
    text = (ROOT / "docs" / "how-to" / "top.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    run = await system.python("-c", program.replace("callboard://127.0.0.1:7411", system.url))
    assert await run.wait_for_exit() == 0
    assert re.fullmatch(r"/addison \d+\.\d+\n/parameter_events 0\.0\n/rosout \d+\.\d+", run.output)


@pytest.mark.parametrize("key", [b"q", b"\x03"], ids=["q", "ctrl-c"])
async def test_the_live_view_draws_and_quits(system: System, key: bytes) -> None:
    """q and Ctrl-C end it with 0 and restore the terminal."""
    await system.broker()
    publisher = await system.example("minimal_publisher")
    await publisher.wait_for_line("Publishing")
    async with on_terminal("top", "--url", system.url, term="xterm-256color") as terminal:
        await terminal.wait_for_text("/addison")
        terminal.type_keys(key)
        await terminal.wait_for_text("\x1b[?1049l")
        assert await terminal.wait_for_exit() == 0
        assert terminal.settings == terminal.before
