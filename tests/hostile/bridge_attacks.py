"""Attacks of full size on a bridge to ROS 2; their target is the broker's URL. They need build/ros2."""

from __future__ import annotations

import asyncio
import secrets
import sys
import threading
from contextlib import closing
from itertools import count
from typing import Final

import actors
from actors.interfaces.message import type_hash, type_name
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.hostile.attacks import Link
from tests.hostile.victims import Attack, Processes, Started, Victim
from tests.real_ros import REAL_PYTHON
from tests.real_ros.sides import Domain

ALIVE: Final = 500
"""Nodes of a changing graph at a time."""
CALLERS: Final = 20
CALLS: Final = 500
"""Calls of each caller that wait at the same time."""


def _start_bridge(processes: Processes, name: str) -> Started:
    """Start a broker, a bridge and nodes of ROS 2, in a domain of their own."""
    domain = Domain(0)
    processes.at_end(domain.close)
    _, url = processes.broker(name)
    env = {
        "ROS_DOMAIN_ID": str(domain.number),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(processes.folder),
    }
    real = str(REAL_PYTHON)
    processes.program(real, "-m", "tests.ros2.programs.innocents", env=env)
    words = ("bridge", "ros2", "--domain-id", str(domain.number), "--url", url)
    bridge = processes.program(real, "-m", "actors", *words, env=env)
    return Started(bridge.pid, (url,), (url,))


BRIDGE: Final = Victim("bridge", _start_bridge, "tests.hostile.crossing_innocents")


def changing_graph(url: str) -> None:
    """Case 90: nodes with endpoints that come and go without end, each of which has mirrors in ROS 2."""
    with closing(Link(url)) as link:
        threading.Thread(target=link.drain, daemon=True).start()
        for number in count(1):
            node = 4 * number
            topic = f"/changing/n{number}"
            publisher = make.publisher(node + 1, topic, node=node, type_hash=type_hash(String))
            link.send(
                frames.Node(node, topic),
                publisher._replace(type_name=type_name(String), gid=secrets.token_bytes(16)),
                make.subscription(node + 2, "/innocent_back", node=node, raw=True),
            )
            if number > ALIVE:
                link.send(frames.Undeclare(4 * (number - ALIVE)))


def slow_calls(url: str) -> None:
    """Case 91: thousands of calls at a time to a service of ROS 2 that answers ten in a second."""

    async def attack() -> None:
        async with actors.Node("caller", url=url, use_global_arguments=False) as node:
            clients = [node.create_client(Trigger, "/slow") for _ in range(CALLERS)]

            async def call(client: actors.Client[Trigger.Request, Trigger.Response]) -> None:
                while True:
                    try:
                        await client.call(Trigger.Request(), timeout_sec=1.0)
                    except actors.CallFailed:
                        await asyncio.sleep(0)

            async with asyncio.TaskGroup() as group:
                for client in clients * CALLS:
                    group.create_task(call(client))

    asyncio.run(attack())


def large_messages(url: str) -> None:
    """Case 92: messages of 1 MiB to a topic of ROS 2, as fast as the broker takes them."""

    async def attack() -> None:
        image = Image(height=1024, width=1024, step=1024, encoding="mono8", data=bytes(2**20))
        async with actors.Node("camera", url=url, use_global_arguments=False) as node:
            publisher = node.create_publisher(Image, "/flood", 10)
            while True:
                publisher.publish(image)
                await publisher.ready()
                await asyncio.sleep(0)

    asyncio.run(attack())


ATTACKS: Final = {
    "changing-graph": Attack(90, changing_graph, victim=BRIDGE),
    "slow-calls": Attack(91, slow_calls, victim=BRIDGE),
    "large-messages": Attack(92, large_messages, victim=BRIDGE),
}
if sys.platform != "linux" or not REAL_PYTHON.exists():  # what `make test` builds where there are wheels
    ATTACKS.clear()
