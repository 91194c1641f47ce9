"""Follow docs/how-to/deploy.md."""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
import sys
from typing import TYPE_CHECKING

from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

GUIDE = (ROOT / "docs" / "how-to" / "deploy.md").read_text(encoding="utf-8")


def section(heading: str) -> str:
    """Return a section of the guide."""
    return GUIDE.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def blocks(kind: str, heading: str) -> list[str]:
    """Return the blocks of a kind in a section."""
    return re.findall(rf"^```{kind}\n(.*?)^```$", section(heading), re.MULTILINE | re.DOTALL)


async def started_with(system: System, path: Path) -> Program:
    """Start a broker with a configuration file, at a socket beside it."""
    socket = path.parent / "socket"
    program = await system.python("-m", "broker", "--config", str(path), "--unix", str(socket))
    await program.wait_for_line("listening on")
    return program


async def test_the_section_about_the_file_shows_what_is_printed(system: System, tmp_path: Path) -> None:
    """Its file is accepted, and the printed configuration and the error are as shown."""
    written, printed = blocks("toml", "Configure it with a file")
    path = tmp_path / "broker.toml"
    path.write_text(written, encoding="utf-8")
    await started_with(system, path)
    (command,) = re.findall(r"^    callboard (.* --print-config)$", GUIDE, re.MULTILINE)

    def configuration() -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-m", "actors", *shlex.split(command)]
        return subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)

    assert configuration().stdout.startswith(printed)
    path.write_text("prot = 1\n", encoding="utf-8")
    (said,) = blocks("text", "Configure it with a file")
    assert configuration().stderr == said


async def test_the_section_about_reloads_shows_what_is_logged(system: System, tmp_path: Path) -> None:
    """Changing the options of the example gives the lines of the example."""
    written, _ = blocks("toml", "Configure it with a file")
    (said,) = blocks("text", "Reload the configuration")
    path = tmp_path / "broker.toml"
    path.write_text(written, encoding="utf-8")
    broker = await started_with(system, path)
    path.write_text(written.replace("7412", "7499").replace("60", "90"), encoding="utf-8")
    broker.send_signal(signal.SIGHUP)
    for line in said.splitlines():
        level, _, text = line.split("] ", maxsplit=2)
        assert (await broker.wait_for_line(text)).startswith(level)
