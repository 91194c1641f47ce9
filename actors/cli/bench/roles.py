"""What one process of a trial does: `python -m actors.cli.bench.roles '<json parameters>'`.

The processes of a trial meet at their broker: publisher and requester wait for their counterpart, and a
message on `END_TOPIC` ends the trial. So the parent only starts them, and reads the figures that each of
them prints at its end, as a line of JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.cli.bench.machine import cpu_s
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String, UInt8MultiArray, UInt64

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

TOPIC: Final = "bench"
SERVICE: Final = "bench_add"
END_TOPIC: Final = "bench_end"
"""Carries how many messages or calls there were."""
KEEP_ALL: Final = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
MEETING_SEC: Final = 30.0
"""How long the other process may take to start."""
GRACE_SEC: Final = 30.0
"""How long the last messages may take after the load."""
WARM_UP_CALLS: Final = 200
BURST_BYTES: Final = 64 * 1024
BURST_MESSAGES: Final = 200
"""What is published before the loop gets its turn: whichever is less."""
LEAST_MESSAGES: Final = 2
"""A rate needs a first and a last message, however short the load is."""
LONGEST_TEXT_BYTES: Final = 4096
"""Nobody sends texts that are longer; from here on it is binary data."""


class Load:
    """What this process and the broker use, from construction.

    Args:
        broker_pid: The broker's process, if this role measures it.
    """

    def __init__(self, broker_pid: int | None = None) -> None:
        self._broker_pid = broker_pid
        self._broker_sec = None if broker_pid is None else cpu_s(broker_pid)
        self._began = time.perf_counter()
        self._own_sec = time.process_time()

    @property
    def elapsed_sec(self) -> float:
        """Seconds since the load began."""
        return time.perf_counter() - self._began

    def figures(self, messages: int, **more: float) -> dict[str, float | None]:
        """Return CPU times and the number of messages, and the additional figures of a role."""
        own_sec = time.process_time() - self._own_sec
        broker_sec = None
        if self._broker_pid is not None and self._broker_sec is not None:
            broker_sec = (cpu_s(self._broker_pid) or 0.0) - self._broker_sec
        return {"cpu_sec": own_sec, "broker_cpu_sec": broker_sec, "messages": messages, **more}


def payload(size: int) -> actors.Message:
    """Return a message that is nothing but its payload."""
    return String(data="x" * size) if size <= LONGEST_TEXT_BYTES else UInt8MultiArray(data=bytes(size))


async def publisher(
    *, url: str, seconds: float, size: int, broker_pid: int, **_: object
) -> dict[str, float | None]:
    """Publish one message again and again, as fast as KEEP_ALL lets it."""
    message = payload(size)
    burst = min(BURST_MESSAGES, max(1, BURST_BYTES // size))
    async with actors.Node("bench_publisher", url=url) as node:
        pub = node.create_publisher(type(message), TOPIC, KEEP_ALL)
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)
        await pub.wait_for_subscriptions(1, MEETING_SEC)
        await end.wait_for_subscriptions(1, MEETING_SEC)
        load = Load(broker_pid)
        sent = 0
        while load.elapsed_sec < seconds or sent < LEAST_MESSAGES:
            for _each in range(burst):
                pub.publish(message)
            sent += burst
            await pub.ready()
            await asyncio.sleep(0)
        end.publish(UInt64(data=sent))
        await pub.flush()
        await end.flush()
        return load.figures(sent, lost=pub.dropped)


class Arrivals:
    """Counts messages, and reads the clock at the first and the last of them only."""

    def __init__(self) -> None:
        self.received = 0
        self.began = self.ended = 0.0
        self.all_received = asyncio.Event()
        self._due = 0

    def on_message(self, _: object) -> None:
        """Count one."""
        self.received += 1
        if self.received == 1:  # never the last one, see LEAST_MESSAGES
            self.began = time.perf_counter()
        elif self.received == self._due:
            self._finish()

    def on_end(self, msg: UInt64) -> None:
        """Learn how many there are. This may come before the last of them: topics have no common order."""
        self._due = msg.data
        if self.received >= self._due:
            self._finish()

    def _finish(self) -> None:
        self.ended = time.perf_counter()
        self.all_received.set()


async def subscriber(*, url: str, seconds: float, size: int, **_: object) -> dict[str, float | None]:
    """Count messages until all have been received."""
    arrivals = Arrivals()
    async with actors.Node("bench_subscriber", url=url) as node:
        sub = node.create_subscription(type(payload(size)), TOPIC, arrivals.on_message, KEEP_ALL)
        node.create_subscription(UInt64, END_TOPIC, arrivals.on_end, KEEP_ALL)
        load = Load()
        async with asyncio.timeout(MEETING_SEC + seconds + GRACE_SEC):
            await arrivals.all_received.wait()
        lost = sub.lost + sub.lost_on_break + sub.dropped + sub.undecodable
        return load.figures(arrivals.received, elapsed_sec=arrivals.ended - arrivals.began, lost=lost)


async def server(*, url: str, seconds: float, **_: object) -> dict[str, float | None]:
    """Add until the requester has ended."""
    ended = asyncio.Event()

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    def end(_: UInt64) -> None:
        ended.set()

    async with actors.Node("bench_server", url=url) as node:
        node.create_subscription(UInt64, END_TOPIC, end, KEEP_ALL)
        service = node.create_service(AddTwoInts, SERVICE, add)
        load = Load()
        async with asyncio.timeout(MEETING_SEC + seconds + GRACE_SEC):
            await ended.wait()
        return load.figures(service.served)


async def requester(
    *, url: str, seconds: float, in_flight: int, broker_pid: int, **_: object
) -> dict[str, float | None]:
    """Keep calls in flight, and check every sum."""
    times_sec: list[float] = []
    async with actors.Node("bench_requester", url=url) as node:
        client = node.create_client(AddTwoInts, SERVICE)
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)

        async def call(number: int) -> None:
            response = await client.call(AddTwoInts.Request(a=number, b=3))
            if response.sum != number + 3:
                raise RuntimeError(f"{number} + 3 is not {response.sum}")

        async def call_again(load: Load) -> None:
            while (began := load.elapsed_sec) < seconds:
                await call(len(times_sec))
                times_sec.append(load.elapsed_sec - began)

        if not await client.wait_for_service(MEETING_SEC):
            raise RuntimeError(f"nobody serves {client.srv_name}")
        await end.wait_for_subscriptions(1, MEETING_SEC)
        for number in range(WARM_UP_CALLS):
            await call(number)
        load = Load(broker_pid)
        async with asyncio.TaskGroup() as group:
            for _each in range(in_flight):
                group.create_task(call_again(load))
        calls, rate = len(times_sec), len(times_sec) / load.elapsed_sec
        figures = load.figures(calls, rate=rate, **percentiles_us(times_sec))
        end.publish(UInt64(data=calls))
        await end.flush()
        return figures


def percentiles_us(times_sec: Sequence[float]) -> dict[str, float]:
    """Return the median, the 99th and the 99.9th percentile, in us."""
    ordered = sorted(times_sec)
    marks = {"p50_us": 0.5, "p99_us": 0.99, "p999_us": 0.999}
    return {name: 1e6 * ordered[int(mark * (len(ordered) - 1))] for name, mark in marks.items()}


ROLES: Final[Mapping[str, Callable[..., Any]]] = {
    each.__name__: each for each in (publisher, subscriber, server, requester)
}


def main() -> int:
    """Play a role; return the exit code."""
    parameters: dict[str, Any] = json.loads(sys.argv[1])
    figures = actors.run(lambda: ROLES[parameters.pop("role")](**parameters), args=[])
    if figures is None:  # a signal has ended it
        return 1
    print(json.dumps(figures), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
