"""Draw the pictures of graphs: what `callboard graph` writes while nodes run.

python docs/pictures.py [FILE]              default: docs/graph.svg, the course's five nodes, for README.md
PYTHONPATH=. build/ros2/bin/python docs/pictures.py --ros2 [FILE]
                                            default: docs/how-to/ros2-bridge.svg, the programs of that guide
"""  # noqa: INP001 - a script, no package

from __future__ import annotations

import asyncio
import os
import re
import runpy
import signal
import sys
from contextlib import AsyncExitStack
from pathlib import Path

import broker
import callboard
from actors.interfaces.std_msgs.msg import Float64
from actors.interfaces.std_srvs.srv import SetBool

ROOT = Path(__file__).resolve().parent.parent
NODES = (
    "MinimalPublisher",
    "MinimalSubscriber",
    "PublishingSubscriber",
    "AddTwoIntsServer",
    "AddTwoIntsClient",
)
DOMAIN = "101"
"""Of ROS 2: seldom used by others."""


async def draw_course(picture: Path) -> None:
    """Run a broker and the course, wait until all nodes are in the graph, and draw the graph."""
    course = runpy.run_path(str(ROOT / "examples" / "course_decorated.py"))
    async with broker.Broker(broker.BrokerOptions(port=0)) as hub, AsyncExitStack() as stack:
        os.environ["CALLBOARD_URL"] = hub.url
        nodes = [course[name]() for name in NODES]
        for node in nodes:
            await stack.enter_async_context(node)
        for node in nodes:
            for other in nodes:
                await node.wait_for_node(other.get_fully_qualified_name())
        await _draw(picture)


async def draw_bridge(picture: Path) -> None:
    """Run a broker, a bridge and the programs of its guide, wait until they are connected, and draw."""
    guide = (ROOT / "docs" / "how-to" / "ros2-bridge.md").read_text(encoding="utf-8")
    programs = {
        name: re.findall(rf"^```python\n# {name}\.py\n(.*?)^```$", guide, re.MULTILINE | re.DOTALL)[0]
        for name in ("robot", "pilot")
    }
    commands = [("-c", each) for each in programs.values()] + [("-m", "actors", "bridge", "ros2")]
    async with broker.Broker(broker.BrokerOptions(port=0)) as hub:
        os.environ |= {"CALLBOARD_URL": hub.url, "ROS_DOMAIN_ID": DOMAIN, "CALLBOARD_DOMAIN": "0"}
        running = [await asyncio.create_subprocess_exec(sys.executable, *each) for each in commands]
        async with callboard.Node("_painter") as painter:
            for name in programs:
                await painter.wait_for_node(f"/{name}")
            await painter.create_client(SetBool, "/lights").wait_for_service()
            battery = painter.create_subscription(Float64, "/battery", qos_profile=10)
            await anext(aiter(battery))
        await _draw(picture)
        for process in running:
            process.send_signal(signal.SIGINT)
        for process in running:
            await process.wait()


async def _draw(picture: Path) -> None:
    command = (sys.executable, "-m", "actors", "graph", "--output", str(picture))
    graph = await asyncio.create_subprocess_exec(*command)
    if await graph.wait():
        sys.exit(1)


if __name__ == "__main__":
    files = [each for each in sys.argv[1:] if each != "--ros2"]
    draw, default = draw_course, "graph.svg"
    if "--ros2" in sys.argv:
        draw, default = draw_bridge, "how-to/ros2-bridge.svg"
    asyncio.run(draw(Path(files[0]) if files else ROOT / "docs" / default))
