"""A whole system over TLS, set up as docs/security.md says."""

from __future__ import annotations

import re
import shlex
import shutil
import signal
import sys
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

GUIDE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")


class Reader:
    """Runs the commands of a section of the guide in a folder, with a port of its own.

    Attributes:
        broker: The broker that was started last.
        output: What the last other command printed.
    """

    def __init__(self, system: System, folder: Path) -> None:
        self.broker: Program | None = None
        self.output = ""
        self._system = system
        self._folder = folder

    async def follow(self, heading: str) -> None:
        """Run the commands between a heading and the next one."""
        section = GUIDE.split(f"# {heading}\n", 1)[1].split("\n#", 1)[0]
        for line in re.findall(r"^    (\S.*)$", section, re.MULTILINE):
            await self._run(line.replace("$PWD", str(self._folder)).replace("7411", str(self._system.port)))

    async def _run(self, line: str) -> None:
        program, *arguments = shlex.split(line)
        if program == "export":
            self._system.variables.update(dict(each.split("=", 1) for each in arguments))
        elif program == "systemctl":
            assert self.broker is not None
            self.broker.send_signal(signal.SIGHUP)
        elif arguments[0] == "broker":
            if self.broker is not None:
                await self.broker.stop()
            self.broker = await self.callboard(*arguments, "--port", str(self._system.port))
            await self.broker.wait_for_line("listening on callboards://")
        elif program == "callboard":
            await self.succeed(*arguments)
        else:
            await self._succeed(await self._system.program(program, *arguments, folder=self._folder))

    async def callboard(self, *arguments: str) -> Program:
        """Start a command."""
        environ = {"PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(self._folder)}
        command = (sys.executable, "-m", "actors", *arguments)
        return await self._system.program(*command, folder=self._folder, environ=environ)

    async def succeed(self, *arguments: str) -> str:
        """Run a command, and return what it prints."""
        return await self._succeed(await self.callboard(*arguments))

    async def _succeed(self, program: Program) -> str:
        assert await program.wait_for_exit() == 0, program.output
        self.output = program.output
        return self.output


@pytest.mark.skipif(shutil.which("openssl") is None, reason="the guide uses openssl")
async def test_a_system_over_tls_as_the_guide_sets_it_up(system: System, tmp_path: Path) -> None:
    """Topics, services, queries, a launch of nodes, a renewal and client certificates work over TLS."""
    reader = Reader(system, tmp_path)
    await reader.follow("TLS in five minutes")
    subscriber = await system.example("minimal_subscriber")
    await system.example("minimal_publisher")
    await subscriber.wait_for_line("I heard")
    await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", "5", "3")
    await client.wait_for_line("Sum: 8")
    assert "/addison" in await reader.succeed("topic", "list")
    assert "answers in" in await reader.succeed("doctor")
    await reader.follow("Renew the certificate")
    assert reader.broker is not None
    await reader.broker.wait_for_line("Reloaded")
    assert "/minimal_publisher" in await reader.succeed("node", "list")
    await reader.follow("Require certificates of clients")
    assert "/minimal_publisher" not in reader.output  # it has no certificate
    del system.variables["CALLBOARD_CERT"], system.variables["CALLBOARD_KEY"]
    refused = await reader.callboard("node", "list")
    assert await refused.wait_for_exit() == 3
    assert "requires a client certificate" in refused.output


@pytest.mark.skipif(shutil.which("openssl") is None, reason="the guide uses openssl")
async def test_rules_as_the_guide_makes_them(system: System, tmp_path: Path) -> None:
    """A token of the guide lets in; a user that the guide removes is out, also where it is connected."""
    reader = Reader(system, tmp_path)
    await reader.follow("TLS in five minutes")
    await reader.follow("Rules in five minutes")
    assert "roles.observer.allow.subscribe" in reader.output
    assert reader.broker is not None
    system.variables["CALLBOARD_TOKEN_FILE"] = str(tmp_path / "dashboard.token")
    await system.example("minimal_subscriber")
    await reader.broker.wait_for_line("/minimal_subscriber")
    await reader.follow("Take rights away")
    await reader.broker.wait_for_line("Reloaded: the access rules")
    refused = await reader.callboard("node", "list")
    assert await refused.wait_for_exit() != 0
    assert "refuses this client" in refused.output
    system.variables["CALLBOARD_TOKEN_FILE"] = str(tmp_path / "operator.token")
    assert "/minimal_subscriber" not in await reader.succeed("node", "list")
