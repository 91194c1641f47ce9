"""Short-lived nodes that use every kind of endpoint, and permanent nodes whose connections break.

Writes events "sample" with its own and the broker's memory, and ends by itself.
"""

from __future__ import annotations

import asyncio
import gc
import os
import re
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.testing import FaultProxy
from benchmarks.faults.roles.controller import Controller, report
from benchmarks.harness import meters

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

TOPICS: Final = 3
SERVICES: Final = 2
ENDPOINTS: Final = 2 * (TOPICS + SERVICES)
"""Of one node: publishers, subscriptions, services and clients."""
CALLS: Final = 10
"""Of one node; half of them are cancelled."""
MESSAGES: Final = 10
WORKERS: Final = 4
"""Short-lived nodes at the same time."""
PERMANENT: Final = 10
"""Nodes whose connections break, all at once."""
LIVES_PER_BREAK: Final = 10
NAMES: Final = 50
"""Names of each worker's nodes, reused, because Python's logging keeps a logger for every name."""

_ANONYMOUS: Final = re.compile(r"^Anonymous:\s+(\d+) kB$", re.MULTILINE)

LATCHED: Final = actors.QoSProfile(depth=3, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def run(parameters: Mapping[str, Any], controller: Controller) -> None:
    """Start and stop `lives` nodes in several workers; sample `samples` times."""
    del controller
    url, lives, broker = parameters["url"], parameters["lives"], parameters["broker_pid"]
    every = max(1, lives // parameters["samples"])
    numbers = iter(range(lives))
    async with AsyncExitStack() as stack:
        proxy = await stack.enter_async_context(FaultProxy(url))
        permanent = [actors.Node(f"permanent_{i}", url=proxy.url) for i in range(PERMANENT)]
        for node in permanent:
            await stack.enter_async_context(node)
            await node.get_graph()
            _create_endpoints(node, node.get_name())
        async with asyncio.TaskGroup() as group:
            for worker in range(WORKERS):
                group.create_task(_work(numbers, worker, url, proxy, (every, broker)))
        # A session that was lost is there again when the node is in the graph.
        await asyncio.gather(*(each.wait_for_node(each.get_fully_qualified_name()) for each in permanent))
        _sample(lives, broker)
    report("done", resets=proxy.resets)


async def _work(
    numbers: Iterator[int], worker: int, url: str, proxy: FaultProxy, sampling: tuple[int, int]
) -> None:
    every, broker = sampling
    for number in numbers:
        if number % every == 0:
            _sample(number, broker)
        if number % LIVES_PER_BREAK == 0:
            for connection in proxy.connections:
                connection.reset()
        await _run_node(f"life_{worker}_{number % NAMES}", url)


async def _run_node(name: str, url: str) -> None:
    """Start a node, use each endpoint, and stop it."""
    async with actors.Node(name, url=url) as node:
        client = _create_endpoints(node, name)
        await client.wait_for_service()
        calls = [client.call_async(AddTwoInts.Request(a=i, b=1)) for i in range(CALLS)]
        for call in calls[::2]:
            call.cancel()
        await asyncio.gather(*calls[1::2])


def _create_endpoints(node: actors.Node, name: str) -> actors.Client[Any, Any]:
    """Create a node's endpoints; return a client of its last service."""

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    def hear(msg: Int64) -> None:
        del msg

    for i in range(TOPICS):
        node.create_subscription(Int64, f"{name}_{i}", hear, LATCHED)
        publisher = node.create_publisher(Int64, f"{name}_{i}", LATCHED)
        for number in range(MESSAGES):
            publisher.publish(Int64(data=number))
    for i in range(SERVICES):
        node.create_service(AddTwoInts, f"{name}_{i}", add)
    return [node.create_client(AddTwoInts, f"{name}_{i}") for i in range(SERVICES)][-1]


def own_memory_kib(pid: int) -> float | None:
    """Return the private memory of a process in KiB, which other processes do not affect."""
    try:
        found = _ANONYMOUS.search(Path(f"/proc/{pid}/smaps_rollup").read_text("ascii"))
    except OSError:
        found = None
    return meters.memory_kib(pid) if found is None else float(found[1])


def _sample(number: int, broker: int) -> None:
    gc.collect()
    memory = {"nodes": own_memory_kib(os.getpid()), "broker": own_memory_kib(broker)}
    files = {"nodes": meters.open_files(os.getpid()), "broker": meters.open_files(broker)}
    report("sample", lives=number, memory_kib=memory, files=files)
