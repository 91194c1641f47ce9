"""docs/tutorial.md, step by step: from an empty folder to a wheel that is installed and launched."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.guides import Reader, builds_packages

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System


@pytest.mark.long
@builds_packages
@pytest.mark.timeout(6 * DEADLINE_SEC)
async def test_the_tutorial_can_be_followed(system: System, tmp_path: Path) -> None:
    """Each command and each node prints what is shown."""
    bags = ("callboard bag record /addison -o greetings", "callboard bag play greetings --loop")
    goes_on = {command: tuple(command.split()) for command in bags}
    reader = Reader(system, tmp_path, ends_alone="client", goes_on=goes_on, forks=True)
    await reader.follow((ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8"))
    assert (reader.folder / "course" / "course.svg").read_text(encoding="utf-8").startswith("<svg")
