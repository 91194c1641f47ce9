"""`python -m benchmarks.browser.roles '<json parameters>'`: nodes for the page to show, in this process."""

from __future__ import annotations

import asyncio
import gc
import json
import sys
import time
from contextlib import AsyncExitStack
from importlib import import_module
from typing import Any, Final

import actors
from actors.interfaces.std_msgs.msg import String
from benchmarks.faults.roles.controller import CLOSED, Controller, report
from benchmarks.harness.roles.messages import KEEP_ALL, imu

ROBOT: Final = 10
"""Nodes of one namespace."""
EDGES: Final = 4
"""Of a node: what it publishes, and what it subscribes to."""
STREAM: Final = "/stream"
"""The topic whose messages are shown."""
VISIT_S: Final = 1.0
"""How long visitors stay, and stay away."""


def _node(number: int, url: str) -> actors.Node:
    """Return a node that subscribes to topics of two nodes of its robot, and to one of the first robot."""
    robot, place = divmod(number, ROBOT)
    node = actors.Node(f"node_{number}", namespace=f"robot_{robot}", url=url)
    for other in (ROBOT * robot + (place + 1) % ROBOT, ROBOT * robot + (place + 3) % ROBOT, place):
        node.create_subscription(String, f"/robot_{other // ROBOT}/topic_{other}", _ignore, 10)
    return node


def _ignore(_: object) -> None: ...


async def crowd(controller: Controller, *, url: str, first: int, count: int) -> None:
    """Hold nodes `first` to `first + count - 1`; each publishes once a second."""
    async with AsyncExitStack() as stack:
        nodes = [_node(number, url) for number in range(first, first + count)]
        publishers = [
            node.create_publisher(String, f"topic_{number}", 10) for number, node in enumerate(nodes, first)
        ]
        for node in nodes:
            await stack.enter_async_context(node)
        report("ready")
        closed = asyncio.ensure_future(controller.next_command())
        while not closed.done():
            for publisher in publishers:
                publisher.publish(String(data="a message that nobody looks at"))
            await asyncio.wait([closed], timeout=1.0)


async def stream(controller: Controller, *, url: str, per_second: int) -> None:
    """Publish so many messages a second on `STREAM`; what a slow timer misses is made up for at once."""
    message = imu(0)
    async with actors.Node("streamer", url=url) as node:
        publisher = node.create_publisher(type(message), STREAM, 1000)
        report("ready")
        closed = asyncio.ensure_future(controller.next_command())
        began, sent = time.perf_counter(), 0
        while not closed.done():
            due = int((time.perf_counter() - began) * per_second)
            for _ in range(due - sent):
                publisher.publish(message)
            sent = due
            await asyncio.sleep(1 / per_second)


async def visitors(controller: Controller, *, url: str, first: int, count: int) -> None:
    """Let `count` nodes with numbers from `first` on come and go until stdin is closed."""
    report("ready")
    closed = asyncio.ensure_future(controller.next_command())
    while not closed.done():
        async with AsyncExitStack() as stack:
            for number in range(first, first + count):
                await stack.enter_async_context(_node(number, url))
            await asyncio.wait([closed], timeout=VISIT_S)
        await asyncio.wait([closed], timeout=VISIT_S)


async def topics(controller: Controller, *, url: str, count: int) -> None:
    """Publish and subscribe to many topics, all of which have carried messages."""
    async with actors.Node("talker", url=url) as talker, actors.Node("listener", url=url) as listener:
        publishers = [talker.create_publisher(String, f"topic_{number}", KEEP_ALL) for number in range(count)]
        for number in range(count):
            listener.create_subscription(String, f"topic_{number}", _ignore, KEEP_ALL)
        await listener.get_graph()
        for number, publisher in enumerate(publishers):
            for _ in range(number % 10):
                publisher.publish(String(data="x"))
            await publisher.flush()
        report("ready")
        while await controller.next_command() != CLOSED:
            pass


async def cost(_: Controller, *, url: str, nodes: int, order: list[bool]) -> None:
    """Start nodes with and without their diagnostics service, in this order, and report what each start took.

    Only the first has the figure of memory: later ones use what earlier ones have left.
    """
    from benchmarks.many_nodes import resident_kb  # noqa: PLC0415 - not for other roles

    async with actors.Node("warm", url=url):
        pass
    rounds: list[dict[str, Any]] = []
    for number, with_service in enumerate(order):
        gc.collect()
        before_kib = resident_kb()
        began, cpu_began = time.perf_counter(), time.process_time()
        async with AsyncExitStack() as stack:
            names = [f"costed_{each}" for each in range(nodes)]
            held = [actors.Node(name, url=url, start_diagnostics_service=with_service) for name in names]
            await asyncio.gather(*(node.__aenter__() for node in held))
            took, cpu = time.perf_counter() - began, time.process_time() - cpu_began
            for node in held:
                stack.push_async_exit(node)
            gc.collect()
            rounds.append({"service": with_service, "start": took / nodes, "cpu": cpu / nodes})
            if not number:
                rounds[0]["kib"] = (resident_kb() - before_kib) / nodes
    report("cost", rounds=rounds)


def main() -> None:
    """Run a role to its end."""
    parameters: dict[str, Any] = json.loads(sys.argv[1])
    role: Any = getattr(import_module("benchmarks.browser.roles"), parameters.pop("role"))

    async def play() -> None:
        await role(Controller(), **parameters)

    actors.run(play, args=[])


if __name__ == "__main__":
    main()
