"""Measure when all brokers of a mesh see all nodes: `python -m tests.integration.mesh.crowd`.

Each broker is a process, and so are the nodes of each broker. It measures how long it takes until all brokers
know all nodes, from their start when all processes are ready; until one more broker that joins knows them;
until a subscription at that one hears a new publisher; and until all brokers know that one of them was
killed, with its nodes.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import signal
import sys
import time
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import String
from benchmarks.harness import meters
from tests.integration.conftest import System
from tests.integration.mesh.stations import MeshBroker

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.integration.conftest import Program

CROWD = """
import asyncio, signal, sys
from contextlib import AsyncExitStack
import actors
from actors.interfaces.std_msgs.msg import String

async def main():
    name, count = sys.argv[1], int(sys.argv[2])
    begin = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, begin.set)
    print("ready", flush=True)
    await begin.wait()
    async with AsyncExitStack() as stack:
        async with asyncio.TaskGroup() as group:
            for i in range(count):
                node = actors.Node(f"{name}_{i}")
                node.create_publisher(String, f"{name}_{i}", 10)
                node.create_subscription(String, "all", lambda msg: None, 10)
                group.create_task(stack.enter_async_context(node))
        print("entered", flush=True)
        await asyncio.Event().wait()

asyncio.run(main())
"""
"""Creates nodes at SIGUSR1, each with a publisher, a subscription, and what every node has."""


async def measure(brokers: int, nodes: int) -> None:
    """Measure, and print the times."""
    system = System()
    try:
        async with AsyncExitStack() as stack:
            first = MeshBroker(system)
            others = [MeshBroker(system, [first]) for _ in range(brokers - 1)]
            everywhere = [first, *others]
            await asyncio.gather(*(each.start() for each in everywhere))
            watchers = [
                await stack.enter_async_context(actors.Node(f"watcher_{i}", url=each.url))
                for i, each in enumerate(everywhere)
            ]
            await _until_all(watchers, lambda count: count == brokers)
            crowds: list[Program] = []
            for i, each in enumerate(everywhere):
                system.url = each.url
                crowds.append(await system.python("-c", CROWD, f"crowd_{i}", str(nodes)))
            await asyncio.gather(*(each.wait_for_line("ready") for each in crowds))
            empty = _memory(everywhere)
            everyone = brokers * (nodes + 1)

            began = time.monotonic()
            for crowd in crowds:
                crowd.send_signal(signal.SIGUSR1)
            entered = asyncio.gather(*(crowd.wait_for_line("entered") for crowd in crowds))
            seen = asyncio.create_task(_until_all(watchers, lambda count: count == everyone))
            await entered
            _print(f"{brokers} x {nodes} nodes have entered after", began)
            await seen
            _print(f"all {brokers} brokers see all {everyone} nodes after", began)
            remote = nodes * (brokers - 1) * brokers + nodes * brokers
            sys.stdout.write(
                f"memory per node and broker: {(_memory(everywhere) - empty) / remote:.1f} KiB\n"
            )

            late = MeshBroker(system, [first])
            await late.start()
            began = time.monotonic()
            late_watcher = await stack.enter_async_context(actors.Node("late", url=late.url))
            await _until_all([late_watcher], lambda count: count == everyone + 1)
            _print("a broker that joins sees them after", began)

            left = [*watchers[:-1], late_watcher]
            await _until_all(left, lambda count: count == everyone + 1)
            _print("and all others see it after", began)

            _print(
                "a remote subscription hears a new publisher after",
                await _first_heard(watchers[0], late_watcher),
            )

            began = time.monotonic()
            others[-1].kill_now()
            await _until_all(left, lambda count: count == everyone - nodes)
            _print("all see that a broker was killed after", began)
    finally:
        await system.close()


async def _first_heard(talker: actors.Node, listener: actors.Node) -> float:
    """Let a node publish something new to a subscription elsewhere; return when, once it is heard."""
    heard = asyncio.Event()
    listener.create_subscription(String, "news", lambda _: heard.set(), 10)
    await talker.get_graph()
    began = time.monotonic()
    publisher = talker.create_publisher(String, "news", 10)
    await publisher.wait_for_subscriptions(1)
    publisher.publish(String(data="new"))
    await heard.wait()
    return began


def _memory(brokers: list[MeshBroker]) -> float:
    return sum(
        meters.memory_kib(each.program.process.pid) or 0.0 for each in brokers if each.program is not None
    )


async def _until_all(watchers: list[actors.Node], reached: Callable[[int], bool]) -> None:
    await asyncio.gather(*(_until(each, reached) for each in watchers))


async def _until(watcher: actors.Node, reached: Callable[[int], bool]) -> None:
    watch = watcher.watch_graph()
    async for _ in watch.batches():
        if reached(len(watch.snapshot.nodes())):
            break
    watch.destroy()


def _print(text: str, began: float) -> None:
    sys.stdout.write(f"{text} {time.monotonic() - began:.3f} s\n")


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m tests.integration.mesh.crowd", description=__doc__)
    parser.add_argument("--brokers", type=int, default=8)
    parser.add_argument("--nodes", type=int, default=50, help="for each broker")
    chosen = parser.parse_args()
    logging.getLogger("callboard").setLevel(logging.ERROR)
    asyncio.run(measure(chosen.brokers, chosen.nodes))


if __name__ == "__main__":
    main()
