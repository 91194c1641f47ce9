"""How long the command line takes to answer, next to importing what any asyncio program imports.

    python benchmarks/startup.py

Each command runs as a process, alternating with the yardstick, against a broker and a node; medians.
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import sys
import time

import actors
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions

YARDSTICK = ["-c", "import asyncio, argparse, msgpack, msgspec"]
COMMANDS = (
    "--help",
    "topic --help",
    "topic list",
    "topic list -t",
    "topic info /chatter",
    "service list",
    "node list",
)
CALLS = ("param get /talker use_sim_time",)
"""Commands that start a node of their own and call another one. They have no limit."""
LIMIT = 1.5
"""What each of the others may take of the yardstick's time."""


async def took(*arguments: str) -> float:
    """Run Python once; return the seconds."""
    began = time.perf_counter()
    process = await asyncio.create_subprocess_exec(
        sys.executable, *arguments, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE
    )
    _, errors = await process.communicate()
    if process.returncode:
        raise SystemExit(f"{' '.join(arguments)}: {errors.decode()}")
    return time.perf_counter() - began


async def measure(rounds: int) -> dict[str, list[float]]:
    """Return the times of the yardstick ("") and of each command."""
    times: dict[str, list[float]] = {name: [] for name in ("", *COMMANDS, *CALLS)}
    async with Broker(BrokerOptions(port=0)) as broker, actors.Node("talker", url=broker.url) as node:
        await node.create_publisher(String, "chatter", 10).flush()
        for _ in range(rounds):
            for name, found in times.items():
                words = name.split()
                url = [] if "--help" in words else ["--url", broker.url]
                found.append(await took(*(["-m", "actors", *words, *url] if name else YARDSTICK)))
    return times


def main() -> int:
    """Measure, print a table, and say by the exit code whether all are quick enough."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    times = asyncio.run(measure(parser.parse_args().rounds))
    medians = {name: statistics.median(each) for name, each in times.items()}
    yardstick = medians.pop("")
    print(f"{'python ' + ' '.join(YARDSTICK):<58} {1000 * yardstick:6.0f} ms")
    for name, median in medians.items():
        print(f"{'callboard ' + name:<58} {1000 * median:6.0f} ms  {median / yardstick:4.2f}")
    return int(max(medians[name] for name in COMMANDS) > LIMIT * yardstick)


if __name__ == "__main__":
    sys.exit(main())
