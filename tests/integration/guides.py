"""Follow a guide as it is written: write its files, run its commands, and compare what they print."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
import time
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from tests.integration.conftest import Program, System

STEP: Final = re.compile(r"^```(\w+)\n(.*?)^```$|^    (\S[^\n]*)$|(Press Ctrl-C)", re.MULTILINE | re.DOTALL)
LOG_LINE: Final = re.compile(r"(?:\[\S+\] )?\[INFO\] \[[\d.]+\] \[([\w.]+)\]: (.*)")
COUNT: Final = '0123456789"'
"""What log lines that count end with. Who starts first decides the count."""
STARTED_BROKER: Final = re.compile(r"^Started a broker at .*\n", re.MULTILINE)
"""Printed by a command that finds none: that of an earlier one has ended, on a slow machine between them."""
PIP: Final = """
    import runpy, sys
    # Packages that would come from the network are installed already.
    sys.argv[2:2] = ["--no-index", "--no-deps", "--no-build-isolation"]
    runpy.run_module("pip", run_name="__main__")
"""
CALLBOARD: Final = """
    import sys
    from actors.cli.main import main
    sys.exit(main())
"""

IN_ENVIRONMENT: Final = """
import runpy, site, sys
site.addsitedir({site!r})
sys.executable = {python!r}
sys.argv[0] = {program!r}
runpy.run_path({program!r}, run_name="__main__")
"""
"""Runs a program of an environment in an interpreter that was started without it; what it starts has that."""

builds_packages: Final = pytest.mark.skipif(
    int(version("setuptools").partition(".")[0]) < 77,
    reason="building a package needs setuptools 77: pip install -e '.[dev]'",
)


INTERRUPTED_IMPORT: Final = re.compile(
    r"Traceback (?:(?!.*Traceback).*\n)*?.*_gcd_import(?:(?!.*Traceback).*\n)*?.*KeyboardInterrupt\n"
)
"""What Python prints if a launch is interrupted while one of its programs still starts."""


class Environment:
    """A virtual environment with the packages of this one, and its own programs and packages."""

    def __init__(self, folder: Path) -> None:
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
        self.programs = folder / "bin"
        (self.site,) = folder.glob("lib/python*/site-packages")
        shared = [path for path in sys.path if Path(path).name == "site-packages"]
        (self.site / "shared.pth").write_text("\n".join(shared))
        for name, source in (("pip", PIP), ("callboard", CALLBOARD)):
            path = self.programs / name
            path.write_text(f"#!{self.programs / 'python'}\n{textwrap.dedent(source)}")
            path.chmod(0o755)
        search = f"{self.programs}{os.pathsep}{os.environ['PATH']}"
        self.variables = {**os.environ, "PATH": search, "PYTHONPATH": str(ROOT)}


class Reader:
    """Follow a guide, and check that each command succeeds and prints what the guide shows.

    `callboard run` and `callboard launch` go on running, each in a terminal of its own, until the guide
    says "Press Ctrl-C"; their output must contain the shown log lines. The output of other commands must be
    equal to what is shown, except for numbers. The program `ends_alone` ends by itself.

    Args:
        system: The processes.
        folder: For the files of the guide, and its environment.
        ends_alone: As above.
        goes_on: Further commands that go on running, with what runs instead.
        settles: Whether a command that prints something else is repeated: what it shows may need a moment.
        forks: Whether commands may be forked though the guide installs packages. What they start is started.
        foreign: Names of programs of `goes_on` that run nothing of callboard: their ends prove nothing.
    """

    def __init__(
        self,
        system: System,
        folder: Path,
        *,
        ends_alone: str = "",
        goes_on: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
        settles: bool = False,
        forks: bool = False,
        foreign: Collection[str] = (),
    ) -> None:
        self.environment = Environment(folder / "environment")
        self.folder = folder / "work"
        self.folder.mkdir()
        self.outputs: dict[str, str] = {}
        self._ends_alone = ends_alone
        self._goes_on = goes_on
        self._settles = settles
        self._forks = forks
        self._foreign = foreign
        self._latest = ""
        self._installs = False
        self._system = system
        self._running: dict[str, Program] = {}

    async def follow(self, guide: str) -> None:
        """Take every step."""
        self._installs = "pip install" in guide
        for kind, text in _steps(guide):
            if kind == "command":
                await self._do(shlex.split(text), text)
            elif kind == "stop":
                await self._stop()
            elif kind != "text":
                self._write(text)
            elif LOG_LINE.match(text):
                await self._hear(text)
            else:
                await self._compare(self._latest, _without_numbers(text))
        await self._stop()

    async def _compare(self, line: str, wanted: str) -> None:
        """Compare what a command has printed, or prints in the end."""
        end = time.monotonic() + (DEADLINE_SEC if self._settles else 0.0)
        while _without_numbers(self.outputs[line]) != wanted and time.monotonic() < end:
            await self._do(shlex.split(line), line)
        assert _without_numbers(self.outputs[line]) == wanted, f"{line}:\n{self.outputs[line]}"

    def _write(self, text: str) -> None:
        """Write a block to the file in its first line, or replace a section of that file."""
        head, _, body = text.partition("\n")
        path = self.folder / head.removeprefix("# ").removeprefix("<!-- ").removesuffix(" -->")
        if path.suffix == ".toml" and path.exists():
            section = re.escape(body.partition("\n")[0])
            before = path.read_text(encoding="utf-8")
            body, replaced = re.subn(rf"^{section}\n(?:[^\[\n].*\n)*", body, before, flags=re.MULTILINE)
            assert replaced == 1
        path.write_text(body, encoding="utf-8")

    async def _do(self, words: list[str], line: str) -> None:
        if words[:2] == ["callboard", "broker"]:
            await self._system.broker()  # at this test's own address
        elif line in self._goes_on:
            self._running[Path(words[-1]).stem] = await self._start(list(self._goes_on[line]))
        elif words[:2] in (["callboard", "run"], ["callboard", "launch"]) and words[-1] != "--show-args":
            self._running[words[min(3, len(words) - 1)]] = await self._start(words)
        elif words[0] == "cd":
            self.folder = (self.folder / words[1]).resolve()
        elif words[0] != "." and words[1:3] != ["-m", "venv"]:  # the environment is here already
            program = await self._start([word.replace("./callboard", "callboard") for word in words])
            # An installer starts several programs, one after the other.
            limit_sec = DEADLINE_SEC * (3 if "install" in words else 1)
            assert await program.wait_for_exit(limit_sec) == 0, program.output
            self.outputs[line] = program.output
            self._latest = line

    async def _start(self, words: list[str]) -> Program:
        variables = self.environment.variables
        found = shutil.which(words[0], path=variables["PATH"])
        assert found, words[0]
        command = [found, *words[1:]]
        if not self._installs and found == str(self.environment.programs / "python"):
            command[0] = sys.executable  # its packages are the same, and it need not be started
        elif found == str(self.environment.programs / "callboard"):
            if not self._installs:
                command.insert(0, sys.executable)
            elif self._forks:
                python = str(self.environment.programs / "python")
                source = IN_ENVIRONMENT.format(site=str(self.environment.site), python=python, program=found)
                command[:1] = [sys.executable, "-c", source]
        return await self._system.program(*command, folder=self.folder, environ=variables)

    async def _hear(self, lines: str) -> None:
        """Wait for each of these lines from its node."""
        for line in lines.splitlines():
            match = LOG_LINE.fullmatch(line)
            assert match, line
            node, text = match.groups()
            own = self._running.get(node.rpartition(".")[2])
            wanted = f"[{node}]: {text.rstrip(COUNT)}"
            if own:
                await own.wait_for_line(wanted)
            else:  # a launch: the order of its processes' lines is not fixed
                for program in self._running.values():
                    await program.find_line(wanted)

    async def _stop(self) -> None:
        """Press Ctrl-C in each terminal where a node or a launch runs."""
        for name, program in self._running.items():
            code = await (program.wait_for_exit() if name == self._ends_alone else program.stop())
            if name in self._foreign:
                continue
            assert code == 0, program.output
            assert "Traceback" not in INTERRUPTED_IMPORT.sub("", program.output), program.output
        self._running.clear()


def _steps(guide: str) -> Iterator[tuple[str, str]]:
    """Return kind and text of the commands and blocks in the guide's order."""
    for block, text, command, stop in STEP.findall(guide):
        if stop:
            yield "stop", ""
        else:
            yield (block, text) if block else ("command", command)


def _without_numbers(text: str) -> str:
    text = STARTED_BROKER.sub("", text)
    text = re.sub(r"\b[0-9a-f]{32}\b|(?<=b)[0-9a-f]{8}\b|\d+", "0", text.strip("\n"))
    # Columns are as wide as their widest cell.
    return re.sub(r"(?<=\S) {2,}", "  ", text)
