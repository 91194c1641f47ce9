"""What pyright says of callbacks, and of ROS 2's names by their stub files, in one run: it is slow."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Final

from actors.ros.stubs import write_stubs
from tests.integration.conftest import ROOT

DEADLINE_SEC: Final = 100
CALLBACKS: Final = Path(__file__).with_name("callback_types.py")
STRICT: Final = "\n# pyright: strict\n"
FOR_ROS: Final = """
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


def test_pyright_reports_mistakes_and_nothing_else(tmp_path: Path) -> None:
    """Callbacks that do not fit, a mistake in a program for ROS 2, and none in the examples.

    mypy checks the callbacks itself: an unused `type: ignore` is an error.
    """
    text = CALLBACKS.read_text()
    (tmp_path / CALLBACKS.name).write_text(text + STRICT)
    write_stubs(tmp_path / "typings")
    (tmp_path / "wrong.py").write_text(FOR_ROS)
    for name in ("minimal_publisher", "minimal_subscriber", "add_two_ints_server"):
        (tmp_path / f"{name}.py").write_text((ROOT / "examples/rclpy" / f"{name}.py").read_text())
    options = {
        "extraPaths": [str(ROOT)],
        "pythonVersion": "3.11",
        "typeCheckingMode": "standard",
        "enableTypeIgnoreComments": False,
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(options))
    command = ("-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path))
    done = subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, check=False, timeout=DEADLINE_SEC
    )
    callbacks: set[int] = set()
    others: list[tuple[str, str]] = []
    for each in json.loads(done.stdout)["generalDiagnostics"]:
        if each["severity"] == "error":
            if Path(each["file"]).name == CALLBACKS.name:
                callbacks.add(each["range"]["start"]["line"] + 1)
            else:
                others.append((Path(each["file"]).name, each["rule"]))
    assert callbacks == {at for at, line in enumerate(text.splitlines(), 1) if "type: ignore" in line}
    assert others == [("wrong.py", "reportArgumentType")]
