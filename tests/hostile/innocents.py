"""Innocent nodes that measure what happens to them: `python -m tests.hostile.innocents URL [OTHER | calls]`.

One node publishes at 1 kHz and makes 200 calls a second, another one receives and serves, at another broker
if there is a second URL. With `calls` there are only the calls, which somebody else serves. They stop when
standard input ends, and print what they have measured as JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64

TOPIC = "/innocent"
RATE_HZ = 1000
CALL_RATE_HZ = 200
CALLS = "calls"
DEPTH = 5000
"""Messages that a break of five seconds delays and does not drop."""


class Innocents:
    """Two nodes and their samples: pairs of the time of sending and the latency, in seconds.

    Args:
        url: The broker.
        other: The broker of the node that receives and serves; `calls` if there is no such node.
    """

    def __init__(self, url: str, other: str) -> None:
        self.samples: dict[str, list[tuple[float, float]]] = {"message": [], "call": []}
        self.published = self.failed = 0
        self._active = actors.Node("active", url=url, use_global_arguments=False)
        self._passive = actors.Node(
            "passive", url=url if other == CALLS else other, use_global_arguments=False
        )
        self._publisher = self._active.create_publisher(Int64, TOPIC, DEPTH)
        self._client = self._active.create_client(AddTwoInts, "/add")
        self._publishes = other != CALLS
        if self._publishes:
            self._passive.create_subscription(Int64, TOPIC, self._receive, DEPTH)
            self._passive.create_service(AddTwoInts, "/add", add)
        else:
            del self.samples["message"]
        self._calls: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Publish and call until standard input ends; then wait for what is under way."""
        async with self._passive, self._active:
            await self._client.wait_for_service(10)
            sys.stdout.write("ready\n")
            sys.stdout.flush()
            end = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
            began, ticks = time.monotonic(), 0
            while not end.done():
                ticks += 1
                self._tick(ticks)
                await asyncio.sleep(began + ticks / RATE_HZ - time.monotonic())
            await asyncio.wait({asyncio.ensure_future(self._settle())}, timeout=10)

    def _tick(self, number: int) -> None:
        if self._publishes:
            self.published += 1
            self._publisher.publish(Int64(data=time.monotonic_ns()))
        if number % (RATE_HZ // CALL_RATE_HZ) == 0:
            task = asyncio.create_task(self._call())
            self._calls.add(task)
            task.add_done_callback(self._calls.discard)

    async def _call(self) -> None:
        began = time.monotonic()
        try:
            await self._client.call(AddTwoInts.Request(a=1, b=2), timeout_sec=10)
        except actors.CallboardError:
            self.failed += 1
        else:
            self.samples["call"].append((began, time.monotonic() - began))

    def _receive(self, message: Int64) -> None:
        sent = message.data / 1e9
        self.samples["message"].append((sent, time.monotonic() - sent))

    @property
    def received(self) -> int:
        """How many messages have arrived."""
        return len(self.samples.get("message", ()))

    async def _settle(self) -> None:
        while self._calls or self.received < self.published:
            await asyncio.sleep(0.01)


def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    """Answer a call."""
    response.sum = request.a + request.b
    return response


async def main() -> None:
    """Run, and print the samples."""
    url, *other = sys.argv[1:]
    innocents = Innocents(url, *(other or [url]))
    await innocents.run()
    lost = innocents.published - innocents.received
    json.dump({"lost": lost, "failed": innocents.failed, "samples": innocents.samples}, sys.stdout)


if __name__ == "__main__":
    asyncio.run(main())
