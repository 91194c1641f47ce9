"""What many nodes cost: memory and time per node, and the start of a process with one of them.

    python benchmarks/many_nodes.py [--without-standard-endpoints]

The broker is a process of its own; the nodes share one loop. Memory is that of Python's allocations
(tracemalloc) and the growth of the resident set, each in a run of its own, divided by the number of nodes.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import re
import statistics
import sys
import time
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import actors

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

ONE_NODE = """
import asyncio, sys, actors
async def main():
    async with actors.Node("one", url=sys.argv[1], **eval(sys.argv[2])):
        pass
asyncio.run(main())
"""


class Cost(NamedTuple):
    """What one of many nodes costs."""

    traced_kb: float
    resident_kb: float
    start_ms: float


@contextlib.asynccontextmanager
async def broker_process() -> AsyncGenerator[str]:
    """Run a broker on a free port; yield its URL."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "actors", "broker", "--port", "0"),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    assert process.stdout is not None
    try:
        while True:
            line = (await process.stdout.readline()).decode()
            if found := re.search(r"callboard://\S+:\d+", line):
                break
            if not line:
                raise SystemExit("The broker has ended")
        yield found.group()
    finally:
        process.terminate()
        await process.communicate()


def resident_kb() -> int:
    """Return the resident set of this process."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    return int(found.group(1)) if found else 0


async def start(url: str, count: int, options: dict[str, Any], prefix: str) -> contextlib.AsyncExitStack:
    """Enter nodes at the same time; leave them with the stack."""
    nodes = [actors.Node(f"{prefix}_{number}", url=url, **options) for number in range(count)]
    await asyncio.gather(*(node.__aenter__() for node in nodes))
    stack = contextlib.AsyncExitStack()
    for node in nodes:
        stack.push_async_exit(node)
    return stack


async def measure(url: str, count: int, options: dict[str, Any]) -> Cost:
    """Start so many nodes three times: for memory, for traced memory, for time."""
    async with await start(url, 1, options, "warm"):
        gc.collect()
        before = resident_kb()
        async with await start(url, count, options, "resident"):
            gc.collect()
            resident = resident_kb() - before
        tracemalloc.start()
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        async with await start(url, count, options, "traced"):
            gc.collect()
            traced = tracemalloc.get_traced_memory()[0] - before
        tracemalloc.stop()
        times: list[float] = []
        for _ in range(5):
            began = time.perf_counter()
            async with await start(url, count, options, "timed"):
                times.append(time.perf_counter() - began)
    return Cost(traced / 1024 / count, resident / count, 1000 * statistics.median(times) / count)


async def process_ms(url: str, options: dict[str, Any], rounds: int) -> float:
    """Return the median time of a process that enters one node and leaves."""
    times: list[float] = []
    for _ in range(rounds):
        began = time.perf_counter()
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", ONE_NODE, url, repr(options))
        if await process.wait():
            raise SystemExit("The process with one node has failed")
        times.append(1000 * (time.perf_counter() - began))
    return statistics.median(times)


async def main(count: int, rounds: int, options: dict[str, Any]) -> None:
    """Measure and print."""
    async with broker_process() as url:
        cost = await measure(url, count, options)
        one = await process_ms(url, options, rounds)
    print(
        f"{count} nodes, each: {cost.traced_kb:.1f} KiB traced, {cost.resident_kb:.1f} KiB resident, "
        f"{cost.start_ms:.2f} ms until connected"
    )
    print(f"a process with one node: {one:.0f} ms")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--nodes", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--without-standard-endpoints", action="store_true")
    arguments = parser.parse_args()
    bare = {
        "start_parameter_services": False,
        "enable_rosout": False,
        "parameter_overrides": {"start_type_description_service": False},
    }
    without = bare if arguments.without_standard_endpoints else {}
    asyncio.run(main(arguments.nodes, arguments.rounds, without))
