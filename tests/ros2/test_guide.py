"""docs/how-to/ros2-bridge.md, with real ROS 2."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import TYPE_CHECKING

from actors.bridges.options import BridgeOptions, load_options
from tests.integration.conftest import System
from tests.integration.guides import Reader
from tests.real_ros import REAL_PYTHON, ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.ros2.network import Network

GUIDE = (ROOT / "docs" / "how-to" / "ros2-bridge.md").read_text(encoding="utf-8")
FOLLOWED = "## Choose what crosses"
"""Where the part ends that readers follow step by step."""


def blocks(title: str) -> dict[str, str]:
    """Return the files of the section with a title, by their names."""
    section = GUIDE.partition(f"## {title}\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"^```\w+\n# (\S+)\n(.*?)^```$", section, re.MULTILINE | re.DOTALL))


async def test_the_guide_can_be_followed(network: Network, tmp_path: Path) -> None:
    """Each command succeeds and prints what is shown, and so do the nodes of both sides."""
    real = str(REAL_PYTHON)
    system = System()
    system.variables = {**network.environ, "CALLBOARD_DOMAIN": "0", "PYTHONPATH": str(ROOT)}
    goes_on = {
        "python3 robot.py": (real, "robot.py"),
        "callboard bridge ros2": (real, "-m", "actors", "bridge", "ros2"),
        "callboard run pilot.py": (sys.executable, "-m", "actors", "run", "pilot.py"),
    }
    # rclpy 9.1.2 ends with a RuntimeError if SIGINT comes while it takes a message.
    reader = Reader(system, tmp_path, goes_on=goes_on, settles=True, foreign=("robot",))
    try:
        await reader.follow(GUIDE.partition(FOLLOWED)[0])
    finally:
        await system.close()


def test_the_picture_shows_the_nodes_of_the_guide() -> None:
    """After a change: PYTHONPATH=. build/ros2/bin/python docs/pictures.py --ros2."""
    picture = (ROOT / "docs" / "how-to" / "ros2-bridge.svg").read_text(encoding="utf-8")
    names = re.findall(r">(/\w+)(?: \(origin=ros2/\d+\))?<", picture)
    assert {*names} == {"/pilot", "/robot", "/lights", "/throttle", "/battery"}


def test_the_file_of_options_is_valid(tmp_path: Path) -> None:
    """It has every option that there is."""
    path = tmp_path / "bridge.toml"
    path.write_text(blocks("Choose what crosses")["bridge.toml"], encoding="utf-8")
    options = load_options({}, path)
    assert options.depths == (("/map", 1), ("/camera/**", 5))
    assert all(each in path.read_text(encoding="utf-8") for each in BridgeOptions.__dataclass_fields__)


def test_the_launch_files_start_the_same(tmp_path: Path) -> None:
    """In Python and in YAML: a bridge, and a node beside it."""
    files = blocks("In a launch")
    assert {*files} == {"robots.launch.py", "robots.launch.yaml"}
    printed: list[str] = []
    (tmp_path / "pilot.py").touch()
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-m", "actors", "launch", "--dry-run", name],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            check=True,
            capture_output=True,
            text=True,
        )
        printed.append(done.stdout)
    assert "callboard bridge ros2 --domain-id=1 --namespace=robot1" in printed[0]
    assert printed[0] == printed[1]
