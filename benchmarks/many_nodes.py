"""What many nodes cost: memory, time and CPU time per node, and the start of a process with one of them.

    python benchmarks/many_nodes.py [--without-standard-endpoints]

The broker is a process of its own; the nodes share one loop. Memory is that of Python's allocations
(tracemalloc) and the growth of the resident set, each in a run of its own, divided by the number of nodes.
Times have a minimum beside the median: on a shared machine only the minimum is comparable.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import os
import re
import statistics
import sys
import time
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import actors

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Sequence

ONE_NODE = """
import asyncio, sys, actors
async def main():
    async with actors.Node("one", url=sys.argv[1], **eval(sys.argv[2])):
        pass
asyncio.run(main())
"""


class Cost(NamedTuple):
    """What one of many nodes costs; of times, one per round."""

    traced_kb: float
    resident_kb: float
    start_us: Sequence[float]
    client_cpu_us: Sequence[float]
    broker_cpu_us: Sequence[float]


@contextlib.asynccontextmanager
async def broker_process() -> AsyncGenerator[tuple[str, int]]:
    """Run a broker on a free port; yield its URL and its process id."""
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
        yield found.group(), process.pid
    finally:
        process.terminate()
        await process.communicate()


def resident_kb() -> int:
    """Return the resident set of this process."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    return int(found.group(1)) if found else 0


def cpu_us(pid: int) -> float:
    """Return the CPU time that the main thread of a process has used."""
    return int(Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()[0]) / 1000


async def start(url: str, count: int, options: dict[str, Any], prefix: str) -> contextlib.AsyncExitStack:
    """Enter nodes at the same time; leave them with the stack."""
    nodes = [actors.Node(f"{prefix}_{number}", url=url, **options) for number in range(count)]
    await asyncio.gather(*(node.__aenter__() for node in nodes))
    stack = contextlib.AsyncExitStack()
    for node in nodes:
        stack.push_async_exit(node)
    return stack


async def measure(url: str, broker: int, count: int, rounds: int, options: dict[str, Any]) -> Cost:
    """Start so many nodes: once for memory, once for traced memory, and in each round for times."""
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
        times: list[tuple[float, ...]] = []
        for _ in range(rounds):
            gc.collect()
            began = 1e6 * time.perf_counter(), cpu_us(os.getpid()), cpu_us(broker)
            async with await start(url, count, options, "timed"):
                ended = 1e6 * time.perf_counter(), cpu_us(os.getpid()), cpu_us(broker)
            times.append(tuple((after - before) / count for before, after in zip(began, ended, strict=True)))
    return Cost(traced / 1024 / count, resident / count, *zip(*times, strict=True))


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


def spread(times_us: Sequence[float]) -> str:
    """Return the minimum and the median."""
    return f"{min(times_us):4.0f} µs, {statistics.median(times_us):4.0f} µs"


async def main(count: int, rounds: int, options: dict[str, Any]) -> None:
    """Measure and print."""
    async with broker_process() as (url, broker):
        cost = await measure(url, broker, count, rounds, options)
        one = await process_ms(url, options, rounds)
    print(
        f"{count} nodes, each: {cost.traced_kb:.1f} KiB traced, {cost.resident_kb:.1f} KiB resident; "
        "until connected (minimum, median):"
    )
    print(f"    time          {spread(cost.start_us)}")
    print(f"    CPU, nodes    {spread(cost.client_cpu_us)}")
    print(f"    CPU, broker   {spread(cost.broker_cpu_us)}")
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
        "start_diagnostics_service": False,
        "parameter_overrides": {"start_type_description_service": False},
    }
    without = bare if arguments.without_standard_endpoints else {}
    asyncio.run(main(arguments.nodes, arguments.rounds, without))
