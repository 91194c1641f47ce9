"""The commands and the program of docs/how-to/rosbridge.md, as typed, at ports of their own."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

import aiohttp
import pytest

from tests.integration.conftest import ROOT, free_port

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

GUIDE = (ROOT / "docs" / "how-to" / "rosbridge.md").read_text(encoding="utf-8")


async def _served(system: System, port: int, *words: str) -> tuple[Program, str]:
    """Start the server at a port; return its program and the address that it prints, for this machine."""
    words = tuple(word.replace(":9090", f":{port}") for word in words)
    if "--listen" not in words:
        words = (*words, "--listen", f"127.0.0.1:{port}")
    program = await system.program(sys.executable, "-m", "actors", "rosbridge", *words)
    line = await program.wait_for_line("callboard rosbridge listening on ws://")
    return program, line.rpartition(" ")[2].replace("0.0.0.0", "127.0.0.1")


@pytest.mark.parametrize("options", re.findall(r"^    callboard rosbridge(.*)$", GUIDE, re.MULTILINE))
async def test_the_commands_of_the_guide_serve_clients(system: System, options: str) -> None:
    """The printed address works; it has a token exactly if that grants something."""
    await system.broker()
    words = options.split()
    program, address = await _served(system, free_port(), *words)
    assert ("?token=" in address) == ("0.0.0.0:9090" in words)
    origin = {"Origin": words[-1]} if "--allow-origin" in words else {}
    async with aiohttp.ClientSession() as session, session.ws_connect(address, headers=origin) as socket:
        await socket.send_json({"op": "advertise", "id": "a", "topic": "/a", "type": "std_msgs/Nothing"})
        status = await socket.receive_json()
    assert ("--allow-control" in status["msg"]) != ("--allow-control" in words)
    assert await program.stop() == 0


async def test_the_program_of_the_guide_hears_the_example(system: System, tmp_path: Path) -> None:
    """And the output of both is what the guide says."""
    await system.broker()
    await system.example("minimal_publisher")
    port = free_port()
    program, _ = await _served(system, port)
    (shown,) = re.findall(r"```console\n(.*?)```", GUIDE, re.DOTALL)
    assert program.output.replace(str(port), "9090").strip() == shown.strip()
    (source,) = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)
    path = tmp_path / "hear.py"
    path.write_text(source.replace("9090", str(port)), encoding="utf-8")
    heard = await system.program(sys.executable, str(path))
    (text,) = re.findall(r"```text\n(.*?)```", GUIDE, re.DOTALL)
    assert await heard.wait_for_line(text.strip())
    assert await program.stop() == 0


async def test_the_page_can_serve_rosbridge_too(system: System) -> None:
    """Its address is printed."""
    await system.broker()
    listen = ("--listen", f"127.0.0.1:{free_port()}", "--no-browser")
    program = await system.program(sys.executable, "-m", "actors", "web", "--rosbridge", *listen)
    address = (await program.wait_for_line("rosbridge: ws://")).rpartition(" ")[2]
    assert address.endswith("/rosbridge")
    async with aiohttp.ClientSession() as session, session.ws_connect(address) as socket:
        await socket.send_json({"op": "call_service", "service": "/rosapi/get_ros_version"})
        assert (await socket.receive_json())["values"]["version"] == 2
    assert await program.stop() == 0
