"""Follow docs/how-to/mesh.md with two brokers on this machine."""

from __future__ import annotations

import re
import shlex
import sys
from typing import TYPE_CHECKING, Final

from tests.integration.conftest import ROOT, free_port

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

GUIDE: Final = (ROOT / "docs" / "how-to" / "mesh.md").read_text(encoding="utf-8")
BLOCK: Final = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND: Final = re.compile(r"^([ab])\$ (.*)\n((?:(?![ab]\$ ).*\n)*)", re.MULTILINE)
MAIN: Final = "import sys; from actors.cli.main import main; sys.exit(main())"
REPLACED: Final = {"callboard": [sys.executable, "-c", MAIN], "python": [sys.executable]}


class Machines:
    """Two machines that are one: each has a broker at a port of its own."""

    def __init__(self, system: System, folder: Path) -> None:
        self._system = system
        self._folder = folder
        self._ports = {"a": free_port(), "b": free_port()}
        self._mesh_port = free_port()
        self.running: list[Program] = []

    async def run(self, machine: str, line: str) -> str:
        """Run a command on a machine; return what it prints, or "" if it goes on running."""
        line = re.sub(r"tcp/[a\d.]+:7447", f"tcp/127.0.0.1:{self._mesh_port}", line)
        line = line.replace("examples/", f"{ROOT}/examples/")
        port = str(self._ports[machine])
        words = ["sh", "-c", line] if "$(" in line else shlex.split(line)
        if words[:2] == ["callboard", "broker"]:
            words += ["--port", port]
        words[:1] = REPLACED.get(words[0], words[:1])
        broker = f"CALLBOARD_URL=callboard://127.0.0.1:{port}"
        program = await self._system.program("env", broker, *words, folder=self._folder)
        ready = "Mesh: connected" if "--mesh " in line else "listening on"
        if line.startswith("callboard broker") or "examples/" in line:
            self.running.append(program)
            await program.wait_for_line("Publishing" if "examples/" in line else ready)
            return ""
        assert await program.wait_for_exit() == 0, program.output
        return program.output


async def test_the_guide_to_meshes_can_be_followed(system: System, tmp_path: Path) -> None:
    """Each command succeeds and prints what is shown, apart from numbers."""
    machines = Machines(system, tmp_path)
    for block in BLOCK.findall(GUIDE):
        for machine, line, shown in COMMAND.findall(block):
            printed = await machines.run(machine, line)
            if shown:
                assert _without_numbers(printed) == _without_numbers(shown)
    assert len(machines.running) == 3


def _without_numbers(text: str) -> str:
    """Replace numbers and ids, and spaces that depend on their length."""
    return re.sub(r" {2,}", "  ", re.sub(r"\b[0-9a-f]{8}\b|\d+(\.\d+)*", "0", text)).strip()
