"""Let the real command `ros2` see a node of callboard through the bridge: `make ros2cli-bridge`.

    git clone https://github.com/ros2/ros2cli checkouts/ros2cli
    git clone https://github.com/ros2/rosidl_runtime_py checkouts/rosidl_runtime_py
    make ros2cli-bridge UPSTREAM=checkouts

The command runs on real ROS 2 in build/ros2, which has no ros2cli of its own. The packages of the checkouts
are installed with pip into a temporary folder.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import actors
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from tests.real_ros import REAL_PYTHON
from tests.ros2.network import Network
from tests.ros2.ros import interface
from tests.upstream.packages import Packages
from tests.upstream.ros2cli import PACKAGE, PARTS

RUNTIME: Final = "rosidl_runtime_py"
SOURCE: Final = "import sys; from ros2cli.cli import main; sys.exit(main())"
FIBONACCI: Final = "test_msgs/action/Fibonacci"
DIRECT: Final = ("--no-daemon", "--spin-time", "5")
"""Options of queries: no daemon, which would stay, and time for discovery on a busy machine."""
SHOWS: Final[tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]] = (
    (("node", "list", *DIRECT), ("^/robot$",)),
    (
        ("node", "info", "/robot", *DIRECT),
        ("/text: std_msgs/msg/String", "/enable: std_srvs/srv/SetBool", f"/count: {FIBONACCI}"),
    ),
    (("topic", "list", "-t", *DIRECT), (r"/text \[std_msgs/msg/String\]",)),
    (("topic", "info", "-v", "/text", *DIRECT), ("Node name: robot", "Reliability: RELIABLE")),
    (("topic", "echo", "--once", "/text", *DIRECT), ("data: from callboard",)),
    (
        (
            "topic",
            "pub",
            "--once",
            "-w",
            "1",
            "--keep-alive",
            "3",
            "/heard",
            "std_msgs/msg/String",
            "{data: from ROS}",
        ),
        ("publishing #1",),
    ),
    (("service", "list", "-t", *DIRECT), (r"/enable \[std_srvs/srv/SetBool\]",)),
    (
        ("service", "call", "/enable", "std_srvs/srv/SetBool", "{data: true}"),
        ("success=True", "from callboard"),
    ),
    (("param", "get", "/robot", "speed", *DIRECT), ("Integer value is: 7",)),
    (("action", "send_goal", "-f", "/count", FIBONACCI, "{order: 3}"), ("Goal accepted", "SUCCEEDED")),
)
"""The words of commands, and patterns that their output must match in this order."""


def fault(words: tuple[str, ...], patterns: tuple[str, ...], code: int, output: str) -> str:
    """Return what is wrong with a command's output, "" if nothing is."""
    if code:
        return f"exit code {code}"
    place = 0
    for pattern in patterns:
        found = re.compile(pattern, re.MULTILINE).search(output, place)
        if found is None:
            return f"'{pattern}' is not in its output"
        place = found.end()
    return ""


async def _publish(publisher: actors.Publisher[String]) -> None:
    while True:
        publisher.publish(String(data="from callboard"))
        await asyncio.sleep(0.1)


async def run(folder: Path, site: Path) -> int:
    """Run the commands beside a node of callboard; return how many did not show what they should."""
    network = Network(folder)
    fibonacci = interface(FIBONACCI)
    heard: list[str] = []

    def enable(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = request.data, "from callboard"
        return response

    def count(goal: Any) -> Any:
        goal.publish_feedback(fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return fibonacci.Result(sequence=[0, 1, 1])

    faults = 0
    try:
        network.broker()
        network.bridge()
        async with actors.Node("robot", url=network.url) as node, asyncio.TaskGroup() as group:
            node.declare_parameter("speed", 7)
            node.create_service(SetBool, "/enable", enable)
            node.create_action_server(fibonacci, "/count", count)
            node.create_subscription(String, "/heard", lambda each: heard.append(each.data), 10)
            publishing = group.create_task(_publish(node.create_publisher(String, "/text", 10)))
            watcher = await network.ros().node("watcher")
            await watcher.node_names("/robot")
            for number, (words, patterns) in enumerate(SHOWS):
                process = network.process(
                    f"ros2-{number}", str(REAL_PYTHON), "-c", SOURCE, *words, PYTHONPATH=str(site)
                )
                code = await asyncio.to_thread(process.wait)
                output = process.output()
                wrong = fault(words, patterns, code, output)
                faults += bool(wrong)
                _print(
                    f"{'differs' if wrong else 'same':8} ros2 {' '.join(words)}" + f": {wrong}" * bool(wrong)
                )
                if wrong:
                    _print(output)
            publishing.cancel()
    finally:
        await asyncio.to_thread(network.close)
    if heard != ["from ROS"]:
        faults += 1
        _print(f"differs  callboard heard {heard}")
    return faults


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    """Install the packages and run the commands; return 1 if one differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.upstream.bridged_ros2cli", description=__doc__)
    parser.add_argument("folder", type=Path, help="a folder with the checkouts")
    options = parser.parse_args()
    with TemporaryDirectory(prefix="callboard-ros2cli-") as work:
        packages = Packages(options.folder, Path(work))
        missing = packages.install({PACKAGE, *PARTS, RUNTIME})
        if missing:
            raise SystemExit(f"not in {options.folder}: {', '.join(sorted(missing))}")
        logs = Path(work, "log")
        logs.mkdir()
        return int(asyncio.run(run(logs, packages.site)) > 0)


if __name__ == "__main__":
    sys.exit(main())
