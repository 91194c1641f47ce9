"""docs/how-to/package.md, step by step: create, write, install, run, test and distribute a package."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.guides import Reader, builds_packages

if TYPE_CHECKING:
    from tests.integration.conftest import System

GUIDE: Final = (ROOT / "docs" / "how-to" / "package.md").read_text(encoding="utf-8")


@pytest.mark.long
@builds_packages
@pytest.mark.timeout(6 * DEADLINE_SEC)
async def test_the_guide_to_packages_can_be_followed(system: System, tmp_path: Path) -> None:
    """Each command succeeds; each node prints what is shown and exits with 0 on Ctrl-C."""
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
