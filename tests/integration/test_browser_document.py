"""The commands of docs/how-to/browser.md, as typed, at ports of their own."""

from __future__ import annotations

import asyncio
import re
import shutil
import sys
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT, System, free_port

if TYPE_CHECKING:
    from pathlib import Path

GUIDE = (ROOT / "docs" / "how-to" / "browser.md").read_text(encoding="utf-8")
FREEZES = (
    "import atexit, gc, sys; gc.unfreeze(); from actors.cli.main import main;"
    "atexit.register(lambda: print('frozen:', gc.get_freeze_count() > 1000)); sys.exit(main())"
)
"""Runs the command line; says at the end whether the garbage collector skips what the imports have made."""

CURL = re.findall(r"^\$ (curl .*)\n((?:(?!\$ |```).*\n)*)", GUIDE, re.MULTILINE)


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
async def test_the_requests_of_the_guide_print_what_it_shows(system: System) -> None:
    """Except for what is left out there."""
    await system.broker()
    await system.example("minimal_publisher")
    port = free_port()
    listen = ("--listen", f"127.0.0.1:{port}", "--no-browser")
    web = await system.program(sys.executable, "-m", "actors", "web", *listen)
    await web.wait_for_line("callboard web listening on")
    assert len(CURL) == 2
    for command, expected in CURL:
        words = command.replace("127.0.0.1:7412", f"127.0.0.1:{port}").split()
        pattern = re.escape(expected.strip()).replace(r"\.\.\.", ".*")
        for _ in range(100):  # the graph takes a moment to be known
            asked = await system.program(*words, "--max-time", "3")
            await asked.wait_for_exit()
            if re.search(pattern, asked.output):
                break
        assert re.search(pattern, asked.output), (command, asked.output)


@pytest.mark.parametrize("options", re.findall(r"^    callboard web(.*)$", GUIDE, re.MULTILINE))
async def test_the_commands_of_the_guide_serve_the_page(system: System, options: str) -> None:
    """The address has the token exactly if it grants something; Ctrl-C ends it."""
    await system.broker()
    words = [each for each in options.split() if each != "--no-browser"]
    if "--listen" in words:
        words[words.index("--listen") + 1] = f"0.0.0.0:{free_port()}"
    else:
        words += ["--listen", f"127.0.0.1:{free_port()}"]
    web = await system.program(sys.executable, "-m", "actors", "web", *words, "--no-browser")
    line = await web.wait_for_line("callboard web listening on http://")
    assert ("#token=" in line) == ("--allow-control" in words or "0.0.0.0" in line)
    assert await web.stop() == 0


async def test_garbage_collections_do_not_hold_up_the_page(system: System) -> None:
    """Case 77: the collector skips what the imports have made, which takes 30 ms at once."""
    await system.broker()
    listen = ("--listen", f"127.0.0.1:{free_port()}", "--no-browser")
    web = await system.program(sys.executable, "-c", FREEZES, "web", *listen)
    await web.wait_for_line("callboard web listening on")
    assert await web.stop() == 0
    await web.find_line("frozen: True")


@pytest.mark.parametrize(
    "command", re.findall(r"^    callboard ((?:broker|launch|demo) .*)$", GUIDE, re.MULTILINE)
)
async def test_other_commands_bring_the_page_with_them(system: System, command: str) -> None:
    """And it ends with them."""
    port = free_port()
    words = [word.replace(":7412", f":{port}") for word in command.split()]
    if words[0] == "broker":
        words += ["--port", str(system.port)]
    program = await system.program(sys.executable, "-m", "actors", *words)
    line = await program.wait_for_line("callboard web listening on http://")
    address = line.rpartition(" ")[2]
    assert await program.stop() in {0, 130}
    asked = await system.program("curl", "--max-time", "3", "--silent", f"{address}healthz")
    assert await asked.wait_for_exit() == 7  # nobody listens there


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
async def test_the_users_of_the_guide_sign_in(system: System, tmp_path: Path) -> None:
    """The commands as they stand there; a request with a user's token is that user's."""
    commands = re.findall(r"^\$ ((?:CALLBOARD_TOKEN_FILE=.* )?callboard .*)$", GUIDE, re.MULTILINE)
    assert len(commands) == 3
    for command in commands[:2]:
        words = [
            str(tmp_path / word) if word.endswith((".token", ".toml")) else word for word in command.split()
        ]
        added = await system.program(sys.executable, "-m", "actors", *words[1:])
        assert await added.wait_for_exit() == 0
    port = free_port()
    variable, _, *words = commands[2].replace("access.toml", str(tmp_path / "access.toml")).split()
    name, _, file = variable.partition("=")
    system.variables[name] = str(tmp_path / file)
    words = [word.replace(":7412", f":{port}") for word in words]
    broker = await system.program(sys.executable, "-m", "actors", *words, "--port", str(system.port))
    await broker.wait_for_line("callboard web listening on")
    token = await asyncio.to_thread((tmp_path / "zoe.token").read_text)
    header = f"Authorization: Bearer {token.strip()}"
    asked = await system.program(
        *("curl", "--silent", "--max-time", "10", "--header", header),
        f"http://127.0.0.1:{port}/api/session",
    )
    assert await asked.wait_for_exit() == 0
    assert '"user":"zoe"' in asked.output
