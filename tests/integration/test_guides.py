"""Follow guides in docs/how-to as they are written."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT
from tests.integration.guides import Reader

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System


@pytest.mark.parametrize(
    "name",
    [
        "actions",
        "bare-nodes",
        "interfaces",
        "lifecycle",
        "logs",
        "parameters",
        "rclpy",
        "ros-programs",
        "threads",
        "time",
    ],
)
async def test_the_guide_can_be_followed(name: str, system: System, tmp_path: Path) -> None:
    """Each command succeeds and prints what is shown."""
    guide = (ROOT / "docs" / "how-to" / f"{name}.md").read_text(encoding="utf-8")
    await Reader(system, tmp_path, settles=True).follow(guide)


async def test_the_guide_of_bags_can_be_followed(system: System, tmp_path: Path) -> None:
    """The recorder goes on until Ctrl-C; all other commands end."""
    guide = (ROOT / "docs" / "how-to" / "bags.md").read_text(encoding="utf-8")
    command = "callboard bag record /chatter -o trip"
    await Reader(system, tmp_path, goes_on={command: tuple(command.split())}).follow(guide)
