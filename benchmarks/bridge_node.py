"""What `benchmarks/bridge.py` runs on callboard: a source and a sink, as those of `bridge_program.py`.

    python benchmarks/bridge_node.py ROLE

They have the same commands.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import struct
import sys
import time
from typing import Any, Final

import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from actors.interfaces.std_srvs.srv import SetBool

DEPTH: Final = 10
HEAD: Final = struct.Struct("<q")


class Source:
    """Publishes at a pace, and calls one after the other."""

    _born: actors.BareNode

    def __init__(self, node: actors.Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(UInt8MultiArray, "/from_callboard", DEPTH)
        self._client = node.create_client(SetBool, "/ros_answer")

    async def load(self, _: str, size: int, rate: float, seconds: float) -> dict[str, float]:
        """Publish so many messages a second; return how many."""
        data = bytearray(size)
        message = UInt8MultiArray(data=data)
        count, start = int(rate * seconds), time.perf_counter()
        for number in range(count):
            await asyncio.sleep(max(0.0, start + number / rate - time.perf_counter()))
            HEAD.pack_into(data, 0, time.monotonic_ns())
            message.data = bytes(data)
            self._publisher.publish(message)
        return {"sent": count, "seconds": time.perf_counter() - start}

    async def calls(self, _: str, seconds: float) -> dict[str, float]:
        """Call one after the other; return the median."""
        await self._client.wait_for_service(60)
        times: list[float] = []
        end = time.perf_counter() + seconds
        while (began := time.perf_counter()) < end:
            response = await self._client.call(SetBool.Request(data=True), timeout_sec=5)
            assert response.success
            times.append(time.perf_counter() - began)
        return {"calls": len(times), "p50_us": 1e6 * statistics.median(times)}

    async def begin(self, name: str) -> float:
        """Start a node; return when."""
        now = time.monotonic()
        self._born = self._node.create_bare_node(name)
        self._born.create_publisher(UInt8MultiArray, "/born", DEPTH)
        return now

    async def end(self) -> float:
        """End the node; return when."""
        now = time.monotonic()
        self._born.destroy()
        return now


class Sink:
    """Receives, answers calls, and sees nodes."""

    def __init__(self, node: actors.Node) -> None:
        self._watch = node.watch_graph()
        self._delays: list[int] = []
        self._first = self._last = 0
        node.create_subscription(UInt8MultiArray, "/to_callboard", self._receive, DEPTH)
        node.create_service(SetBool, "/callboard_answer", self._answer)

    def _receive(self, message: UInt8MultiArray) -> None:
        now = time.monotonic_ns()
        if not self._delays:
            self._first = now
        self._last = now
        self._delays.append(now - HEAD.unpack_from(message.data)[0])

    @staticmethod
    def _answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    async def see(self, name: str, is_there: bool) -> float:  # noqa: FBT001 - as JSON has it
        """Wait until a node is there, or is not; return when."""
        changes = self._watch.batches()
        while (f"/{name}" in self._watch.snapshot.nodes()) != is_there:
            await anext(changes)
        return time.monotonic()

    async def forget(self, _: str) -> None:
        """Forget what was received."""
        self._delays.clear()

    async def count(self, _: str) -> int:
        """Return how many messages were received."""
        return len(self._delays)

    async def figures(self, _: str) -> dict[str, float]:
        """Return how many messages were received, how fast, and the median of their times."""
        found = self._delays
        if len(found) < 2:
            return {"received": len(found), "rate": 0.0, "p50_us": 0.0}
        rate = 1e9 * (len(found) - 1) / (self._last - self._first)
        return {"received": len(found), "rate": rate, "p50_us": statistics.median(found) / 1e3}


async def serve(role: str) -> None:
    """Run a role until the input ends."""
    async with actors.Node(f"bench_callboard_{role}") as node:
        made: Any = {"source": Source, "sink": Sink}[role](node)
        while line := await asyncio.to_thread(sys.stdin.readline):
            command, *arguments = json.loads(line)
            print(json.dumps(await getattr(made, command)(*arguments)), flush=True)


if __name__ == "__main__":
    actors.run(lambda: serve(sys.argv[1]), args=[])
