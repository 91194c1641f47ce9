"""Launch files and scripts that tests write, and `callboard launch` for them."""

from __future__ import annotations

import re
import sys
import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System


def launch_file(folder: Path, *actions: str, **scripts: str) -> str:
    """Write a launch file with these actions, and scripts beside it; return its path."""
    for name, source in scripts.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(source))
    names = sorted({each for action in actions for each in re.findall(r"\b([A-Z]\w+)\(", action)})
    source = f"from actors.launch import {', '.join(['LaunchDescription', *names])}\n\n"
    source += f"def generate_launch_description():\n    return LaunchDescription([{', '.join(actions)}])\n"
    path = folder / "file.launch.py"
    path.write_text(source)
    return str(path)


async def start_launch(system: System, *arguments: str) -> Program:
    """Run `callboard launch` with a short stop timeout."""
    command = sys.executable, "-m", "actors", "launch", "--stop-timeout", "0.2", *arguments
    return await system.program(*command, unbuffered=False)  # the launch sets PYTHONUNBUFFERED
