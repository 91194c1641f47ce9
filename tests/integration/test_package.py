"""docs/how-to/package.md, step by step: a package is created, written, installed, run, tested, handed on."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import sysconfig
import textwrap
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.integration.conftest import Program, System

GUIDE: Final = (ROOT / "docs" / "how-to" / "package.md").read_text(encoding="utf-8")
STEP: Final = re.compile(r"^```(\w+)\n(.*?)^```$|^    (\S[^\n]*)$", re.MULTILINE | re.DOTALL)
COUNT: Final = '0123456789"'
"""What such lines end with."""
PIP: Final = """
    import runpy, sys
    # What comes from the network otherwise is here already.
    sys.argv[2:2] = ["--no-index", "--no-deps", "--no-build-isolation"]
    runpy.run_module("pip", run_name="__main__")
"""
CALLBOARD: Final = """
    import sys
    from actors.cli.main import main
    sys.exit(main())
"""


class Environment:
    """A virtual environment which has what this one has, and its own programs and packages."""

    def __init__(self, folder: Path) -> None:
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
        self.programs = folder / "bin"
        (self.site,) = folder.glob("lib/python*/site-packages")
        shared = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
        (self.site / "shared.pth").write_text("\n".join(shared))
        for name, source in (("pip", PIP), ("callboard", CALLBOARD)):
            path = self.programs / name
            path.write_text(f"#!{self.programs / 'python'}\n{textwrap.dedent(source)}")
            path.chmod(0o755)
        search = f"{self.programs}{os.pathsep}{os.environ['PATH']}"
        self.variables = {**os.environ, "PATH": search, "PYTHONPATH": str(ROOT)}


class Reader:
    """Somebody who does what the guide says, and looks whether that does what it says."""

    def __init__(self, system: System, folder: Path) -> None:
        self.environment = Environment(folder / "environment")
        self.folder = folder / "work"
        self.folder.mkdir()
        self.outputs: dict[str, str] = {}
        self._system = system
        self._running: dict[str, Program] = {}

    async def follow(self, guide: str) -> None:
        """Take every step."""
        for kind, text in steps(guide):
            if kind == "text":
                await self._hear(text)
            elif kind == "command":
                await self._do(shlex.split(text), text)
            else:
                self._write(text)
        await self._stop()

    def _write(self, text: str) -> None:
        """Put a block where its first line says: a file, or a section of one that is there."""
        head, _, body = text.partition("\n")
        path = self.folder / head.removeprefix("# ")
        if path.suffix == ".toml":
            section = re.escape(body.partition("\n")[0])
            before = path.read_text(encoding="utf-8")
            body, replaced = re.subn(rf"^{section}\n(?:[^\[\n].*\n)*", body, before, flags=re.MULTILINE)
            assert replaced == 1
        path.write_text(body, encoding="utf-8")

    async def _do(self, words: list[str], line: str) -> None:
        if words[:2] == ["callboard", "broker"]:
            await self._system.broker()  # where this test has its place
        elif words[:2] == ["callboard", "run"]:
            self._running[words[3]] = await self._start(words)
        else:
            await self._stop()
            if words[0] == "cd":
                self.folder = (self.folder / words[1]).resolve()
                return
            program = await self._start(words)
            assert await program.ends() == 0, program.output
            self.outputs[line] = program.output

    async def _start(self, words: list[str]) -> Program:
        command = str(self.environment.programs / words[0])
        return await self._system.program(
            command, *words[1:], folder=self.folder, environ=self.environment.variables
        )

    async def _hear(self, text: str) -> None:
        """Wait for each of these lines from the node that it is of. Who starts first decides the count."""
        for line in text.splitlines():
            node, said = re.fullmatch(r"\[INFO\] \[[\d.]+\] \[(\w+)\]: (.*)", line).groups()  # type: ignore[union-attr]
            await self._running[node].says(f"[{node}]: {said.rstrip(COUNT)}")

    async def _stop(self) -> None:
        """Press Ctrl-C in each terminal where a node runs."""
        for program in self._running.values():
            assert await program.stop() == 0
            assert "Traceback" not in program.output
        self._running.clear()


def steps(guide: str) -> Iterator[tuple[str, str]]:
    """Return commands and blocks in the guide's order: what kind they are, and their text."""
    for block, text, command in STEP.findall(guide):
        yield (block, text) if block else ("command", command)


@pytest.mark.skipif(
    int(version("setuptools").partition(".")[0]) < 77,
    reason="building a package needs setuptools 77: pip install -e '.[dev]'",
)
@pytest.mark.timeout(6 * DEADLINE_SEC)
async def test_the_guide_to_packages_can_be_followed(system: System, tmp_path: Path) -> None:
    """Each command succeeds, each node says what is shown and ends with 0 on Ctrl-C."""
    reader = Reader(system, tmp_path)
    await reader.follow(GUIDE)
    listed = reader.outputs["callboard pkg executables my_package"]
    assert listed.splitlines() == ["my_package listener", "my_package talker"]
    assert "2 passed" in reader.outputs["python -m pytest"]
    installed = [output for line, output in reader.outputs.items() if line.startswith("pip install")]
    assert len(installed) == 3
    assert all(re.search(r"Successfully installed my.package-0\.0\.0", each) for each in installed), installed
    share = Path(reader.outputs["callboard pkg prefix --share my_package"])
    assert share == reader.environment.site / "my_package"
    assert (share / "launch" / "README.md").is_file()
