"""Nodes that live for a moment, with endpoints of every kind, calls and messages; nodes whose links break.

Says "sample" with its memory and the broker's, from time to time; ends by itself.
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
from actors.bench import meters
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.testing import FaultProxy
from benchmarks.faults.roles.director import Director, report

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

TOPICS: Final = 3
SERVICES: Final = 2
ENDPOINTS: Final = 2 * (TOPICS + SERVICES)
"""Of one life: publishers, subscriptions, services and clients."""
CALLS: Final = 10
"""Of one life; half of them are cancelled."""
MESSAGES: Final = 10
WORKERS: Final = 4
"""Lives at the same time."""
STANDING: Final = 10
"""Nodes that stay, and whose links break all at once."""
LIVES_PER_BREAK: Final = 10
NAMES: Final = 50
"""Of each worker's nodes, used in turn: Python's logging keeps a logger for every name there ever was."""

_ANONYMOUS: Final = re.compile(r"^Anonymous:\s+(\d+) kB$", re.MULTILINE)

LATCHED: Final = actors.QoSProfile(depth=3, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def play(parameters: Mapping[str, Any], director: Director) -> None:
    """Live `lives` lives in a row of workers; sample `samples` times."""
    del director
    url, lives, broker = parameters["url"], parameters["lives"], parameters["broker_pid"]
    every = max(1, lives // parameters["samples"])
    numbers = iter(range(lives))
    async with AsyncExitStack() as stack:
        proxy = await stack.enter_async_context(FaultProxy(url))
        standing = [actors.Node(f"standing_{i}", url=proxy.url) for i in range(STANDING)]
        for node in standing:
            await stack.enter_async_context(node)
            await node.get_graph()
            _furnish(node, node.get_name())
        async with asyncio.TaskGroup() as group:
            for worker in range(WORKERS):
                group.create_task(_work(numbers, worker, url, proxy, (every, broker)))
        await asyncio.gather(*(node.get_graph() for node in standing))
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
        await _live(f"life_{worker}_{number % NAMES}", url)


async def _live(name: str, url: str) -> None:
    """One life: everything is used once, then the node leaves."""
    async with actors.Node(name, url=url) as node:
        client = _furnish(node, name)
        await client.wait_for_service()
        calls = [client.call_async(AddTwoInts.Request(a=i, b=1)) for i in range(CALLS)]
        for call in calls[::2]:
            call.cancel()
        await asyncio.gather(*calls[1::2])


def _furnish(node: actors.Node, name: str) -> actors.Client[Any, Any]:
    """Give a node its endpoints; return a client of its last service."""

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
    """Return the memory that is a process's alone, in KiB: what others start and end must not move it."""
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
