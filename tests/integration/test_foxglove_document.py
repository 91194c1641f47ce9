"""The commands of docs/how-to/foxglove.md, as typed, at ports of their own."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

import aiohttp
import pytest

from tests.integration.conftest import ROOT, free_port

if TYPE_CHECKING:
    from tests.integration.conftest import System

GUIDE = (ROOT / "docs" / "how-to" / "foxglove.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("options", re.findall(r"^    callboard foxglove(.*)$", GUIDE, re.MULTILINE))
async def test_the_commands_of_the_guide_serve_foxglove(system: System, options: str) -> None:
    """The printed address works; it has a token exactly if that grants something."""
    await system.broker()
    port = free_port()
    words = [word.replace(":8765", f":{port}") for word in options.split()]
    if "--listen" not in words:
        words += ["--listen", f"127.0.0.1:{port}"]
    program = await system.program(sys.executable, "-m", "actors", "foxglove", *words)
    line = await program.wait_for_line("callboard foxglove listening on ws://")
    address = line.rpartition(" ")[2].replace("0.0.0.0", "127.0.0.1")
    needs_token = "--allow-control" in words or "0.0.0.0" in line
    assert ("?token=" in address) == needs_token
    link = await program.wait_for_line("Open it in Foxglove: ")
    assert ("https://app.foxglove.dev" in link) != needs_token
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(address, protocols=["foxglove.sdk.v1"]) as socket,
    ):
        info = await socket.receive_json()
    assert ("services" in info["capabilities"]) == ("--allow-control" in words)
    assert await program.stop() == 0


async def test_the_output_of_the_guide_is_what_is_printed(system: System) -> None:
    """At the default port, whose number is replaced here."""
    await system.broker()
    await system.example("minimal_publisher")
    port = free_port()
    listen = ("--listen", f"127.0.0.1:{port}")
    program = await system.program(sys.executable, "-m", "actors", "foxglove", *listen)
    await program.wait_for_line("Open it in Foxglove")
    (shown,) = re.findall(r"```console\n(.*?)```", GUIDE, re.DOTALL)
    assert program.output.replace(str(port), "8765") == shown.strip()
    assert await program.stop() == 0


async def test_the_page_can_serve_foxglove_too(system: System) -> None:
    """Its address is printed."""
    await system.broker()
    listen = ("--listen", f"127.0.0.1:{free_port()}", "--no-browser")
    program = await system.program(sys.executable, "-m", "actors", "web", "--foxglove", *listen)
    line = await program.wait_for_line("Foxglove: ws://")
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(line.rpartition(" ")[2], protocols=["foxglove.sdk.v1"]) as socket,
    ):
        assert (await socket.receive_json())["op"] == "serverInfo"
    assert await program.stop() == 0
