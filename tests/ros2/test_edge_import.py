"""What the edge of a bridge says where there is no ROS 2, or where it has a profile of its own."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.real_ros import REAL_PYTHON, ROOT
from tests.ros2.edge import Edge

if TYPE_CHECKING:
    from pathlib import Path

    from tests.ros2.network import Network

IMPORT = """
from actors.bridges.ros2.errors import RosNotFoundError
from actors.bridges.ros2.importing import import_ros
try:
    print(import_ros().has_own_profile)
except RosNotFoundError as error:
    print(error)
"""
FACE = "import actors.ros.finder as face; face.install(force=True)\n"


def printed(program: str, python: str, environ: dict[str, str], folder: Path = ROOT) -> str:
    """Return what a program prints, which writes nothing to stderr."""
    done = subprocess.run(
        [python, "-c", program],
        check=True,
        capture_output=True,
        text=True,
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), **environ},
    )
    assert not done.stderr
    return done.stdout.strip()


def test_without_ros() -> None:
    """One sentence says what to source or to install."""
    text = printed(IMPORT, sys.executable, {})
    assert text.startswith("the bridge needs ROS 2's rclpy (No module named 'rclpy'): source a ROS 2 (Jazzy")
    assert "pip install '.[ros2]'" in text


def test_beside_a_sourced_ros_of_another_python() -> None:
    """The prefix is named, and how to use that ROS 2 or another one."""
    text = printed(IMPORT, sys.executable, {"AMENT_PREFIX_PATH": "/opt/ros/old"})
    assert text.startswith("rclpy of the sourced ROS 2 (/opt/ros/old) does not work in Python 3.")
    assert "pip install '.[ros2]'" in text


@pytest.mark.parametrize("python", [sys.executable, str(REAL_PYTHON)])
def test_beside_the_face(python: str) -> None:
    """callboard's own rclpy is not taken for ROS 2's."""
    assert "has imported callboard's (actors.ros): start the bridge in a process of its own" in printed(
        FACE + IMPORT, python, {}
    )


def test_the_profile_of_the_user(tmp_path: Path) -> None:
    """Variables and files from which Fast DDS reads a profile are left alone, and so are other variables."""
    real = str(REAL_PYTHON)
    assert printed(IMPORT, real, {}, tmp_path) == "True"
    assert printed(IMPORT, real, {"FASTDDS_DEFAULT_PROFILES_FILE": "/own.xml"}, tmp_path) == "False"
    (tmp_path / "DEFAULT_FASTDDS_PROFILES.xml").touch()
    assert printed(IMPORT, real, {}, tmp_path) == "False"


PARTICIPANT = """
import asyncio, os
from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.importing import import_ros
from actors.bridges.ros2.participant import Participant
before = dict(os.environ)
ros = import_ros()
loop = asyncio.new_event_loop()
participant = Participant(ros, bridge_id="one", arrivals=Arrivals(ros, loop, print))
participant.control.rclpy_node.get_logger().error("to stderr")
participant.close()
print(ros.distribution, sorted({*os.environ} - {*before}))
"""


def test_nothing_is_printed(network: Network) -> None:
    """Fast DDS takes the profile without a word, no variable remains, and log lines are not on stdout."""
    environ = {**network.environ, "RCUTILS_LOGGING_USE_STDOUT": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [str(REAL_PYTHON), "-c", PARTICIPANT], check=True, capture_output=True, text=True, env=environ
    )
    assert done.stdout == "wheels []\n"
    assert done.stderr.splitlines()[0].endswith("to stderr")
    assert len(done.stderr.splitlines()) == 1


def test_a_bridge_starts(network: Network) -> None:
    """It says which ROS 2 it has found."""
    edge = Edge(network.environ, "one")
    assert edge.started == {"distribution": "wheels", "rmw": "rmw_fastrtps_cpp", "has_own_profile": True}
    edge.close()
