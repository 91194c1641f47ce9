"""Stub files for ROS 2's names, as a type checker sees them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from actors.ros.stubs import write_stubs
from tests.integration.conftest import ROOT

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
