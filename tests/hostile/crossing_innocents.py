"""Innocent messages that cross a bridge twice: `python -m tests.hostile.crossing_innocents URL`.

A node publishes at 100 Hz, and `/echo` of ROS 2 (`tests/ros2/programs/innocents.py`) sends each message back.
Like `innocents.py` it stops when standard input ends, and prints JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Final

import actors
from actors.interfaces.std_msgs.msg import Int64

RATE_HZ: Final = 100
DEPTH: Final = 1000
CONNECT_SEC: Final = 30.0
SETTLE_SEC: Final = 10.0


async def main() -> None:
    """Run, and print the samples."""
    samples: list[tuple[float, float]] = []
    first = asyncio.Event()

    def back(message: Int64) -> None:
        sent = message.data / 1e9
        if message.data:
            samples.append((sent, time.monotonic() - sent))
        first.set()

    async with actors.Node("crossing", url=sys.argv[1], use_global_arguments=False) as node:
        publisher = node.create_publisher(Int64, "/innocent", DEPTH)
        node.create_subscription(Int64, "/innocent_back", back, DEPTH)
        async with asyncio.timeout(CONNECT_SEC):  # DDS does not say when all are connected
            while not first.is_set():
                publisher.publish(Int64(data=0))
                await asyncio.sleep(0.1)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        end = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        began, published = time.monotonic(), 0
        while not end.done():
            published += 1
            publisher.publish(Int64(data=time.monotonic_ns()))
            await asyncio.sleep(began + published / RATE_HZ - time.monotonic())
        limit = time.monotonic() + SETTLE_SEC
        while len(samples) < published and time.monotonic() < limit:
            await asyncio.sleep(0.01)
    json.dump({"lost": published - len(samples), "failed": 0, "samples": {"message": samples}}, sys.stdout)


if __name__ == "__main__":
    asyncio.run(main())
