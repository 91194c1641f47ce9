"""Stub files for ROS 2's names."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from actors.ros.finder import module_names
from actors.ros.stubs import main, write_stubs

if TYPE_CHECKING:
    import pytest

ROOT = Path(__file__).resolve().parents[3]
DEADLINE_SEC = 100
PROGRAM = """
import rclpy
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs_py.point_cloud2 import read_points
from std_msgs.msg import String

node = Node("talker")
client = ActionClient(node, Fibonacci, "fibonacci")
rclpy.logging.get_logger("talker").info(rclpy.__name__)
node.create_publisher(String, "chatter", qos_profile_sensor_data).publish(5)
"""


def test_a_type_checker_knows_the_names(tmp_path: Path) -> None:
    """pyright finds mistakes in a program for ROS 2, and none in the examples."""
    write_stubs(tmp_path / "typings")
    (tmp_path / "wrong.py").write_text(PROGRAM)
    for name in ("minimal_publisher", "minimal_subscriber", "add_two_ints_server"):
        (tmp_path / f"{name}.py").write_text((ROOT / "examples/rclpy" / f"{name}.py").read_text())
    options = {"extraPaths": [str(ROOT)], "pythonVersion": "3.11", "typeCheckingMode": "standard"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(options))
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pyright",
            "--outputjson",
            "--pythonpath",
            sys.executable,
            "-p",
            str(tmp_path),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=DEADLINE_SEC,
    )
    found = json.loads(done.stdout)
    errors = [
        (Path(each["file"]).name, each["rule"])
        for each in found["generalDiagnostics"]
        if each["severity"] == "error"
    ]
    assert errors == [("wrong.py", "reportArgumentType")]


def test_every_package_has_a_stub(tmp_path: Path) -> None:
    """With the public names of its modules, and not those that it imports for itself."""
    files = write_stubs(tmp_path, suffix="-stubs")
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}-stubs" for name in module_names()}
    assert all(path.is_file() for path in files)
    logging = (tmp_path / "rclpy-stubs/logging.pyi").read_text()
    assert "import RcutilsLogger as RcutilsLogger\n" in logging
    assert "import get_logger as get_logger\n" in logging
    assert "severity_from_name" not in logging
    assert "from . import node as node\n" in (tmp_path / "rclpy-stubs/__init__.pyi").read_text()
    assert "String as String\n" in (tmp_path / "std_msgs-stubs/msg/__init__.pyi").read_text()
    assert "qos_profile_default" in (tmp_path / "rclpy-stubs/qos.pyi").read_text()


def test_the_command_writes_into_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And says how many; other files there stay."""
    (tmp_path / "own.pyi").write_text("x: int\n")
    main([str(tmp_path)])
    assert capsys.readouterr().out.endswith(f"stub files in {tmp_path}\n")
    assert (tmp_path / "own.pyi").read_text() == "x: int\n"
    assert (tmp_path / "rclpy" / "node.pyi").is_file()
