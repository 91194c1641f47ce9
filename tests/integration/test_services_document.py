"""Run the programs in docs/how-to/services.md and compare their output."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

PROGRAMS = re.findall(
    r"```python\n(.*?)```\n\n```text\n(.*?)```",
    (ROOT / "docs" / "how-to" / "services.md").read_text(encoding="utf-8"),
    re.DOTALL,
)


@pytest.mark.parametrize("number", range(len(PROGRAMS)))
async def test_the_programs_print_what_the_page_shows(system: System, tmp_path: Path, number: int) -> None:
    """Each runs to its end and prints exactly the lines below it."""
    program, expected = PROGRAMS[number]
    script = tmp_path / "program.py"
    script.write_text(program, encoding="utf-8")
    await system.broker()
    running = await system.python(str(script))
    assert await running.wait_for_exit() == 0, running.output
    assert [line for line in running.lines if "[INFO]" not in line] == expected.splitlines()
