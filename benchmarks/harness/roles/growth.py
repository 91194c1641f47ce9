"""What a system has a lot of: topics that all carry something, and requests that are not answered."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import UInt64
from benchmarks.harness.roles.messages import KEEP_ALL, KINDS
from benchmarks.harness.roles.parent import Load
from benchmarks.harness.roles.requests import WAIT_S
from benchmarks.harness.roles.stream import END_TOPIC, GRACE_S, TOPIC, Count

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent

HOLD_SERVICE: Final = "bench_hold"
COUNT_SERVICE: Final = "bench_count"


async def topics_publisher(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish on `topics` topics in turn, `burst` messages a loop turn."""
    message = KINDS["plain"](parameters["size"])
    topics: int = parameters["topics"]
    async with actors.Node("bench_publisher", url=parameters["url"]) as node:
        pubs = [node.create_publisher(type(message), f"{TOPIC}_{n}", KEEP_ALL) for n in range(topics)]
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)
        await parent.ready()
        await node.get_graph()  # behind our declarations, so what is there to match has been matched
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        sent = 0
        while time.perf_counter() < stop:
            for _ in range(parameters["burst"]):
                pub = pubs[sent % topics]
                pub.publish(message)
                sent += 1
                await pub.ready()  # which is no turn of the loop while there is room
            await asyncio.sleep(0)
        end.publish(UInt64(data=sent))
        for pub in pubs:
            await pub.flush()
        await end.flush()
        return load.figures(sent, sent=sent, lost=sum(pub.dropped for pub in pubs))


async def topics_subscriber(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Count what comes on `topics` topics."""
    message_type = type(KINDS["plain"](parameters["size"]))
    count = Count(1)
    async with actors.Node("bench_subscriber", url=parameters["url"]) as node:
        held = [
            node.create_subscription(message_type, f"{TOPIC}_{n}", count.on_message, KEEP_ALL)
            for n in range(parameters["topics"])
        ]
        node.create_subscription(UInt64, END_TOPIC, count.on_end, KEEP_ALL)
        await node.get_graph()  # behind our declarations: they are in force
        await parent.ready()
        load = Load()
        await count.wait(parameters["seconds"] + GRACE_S)
        return {**load.figures(count.received), **count.figures(held)}


async def holder(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Serve requests by never answering them; report on another service how many there are."""

    async def hold(_: AddTwoInts.Request) -> AddTwoInts.Response:
        await parent.gone()
        return AddTwoInts.Response()

    def count(_: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=holding.pending)

    async with actors.Node("bench_holder", url=parameters["url"]) as node:
        holding = node.create_service(AddTwoInts, HOLD_SERVICE, hold, concurrent=True)
        node.create_service(AddTwoInts, COUNT_SERVICE, count, concurrent=True)
        await node.get_graph()  # behind our declarations: the services are there
        await parent.ready()
        load = Load()
        await parent.gone()
        return load.figures(holding.pending)


async def hoarder(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Have `pending` requests unanswered while others work."""
    wanted: int = parameters["pending"]
    async with actors.Node("bench_hoarder", url=parameters["url"]) as node:
        client = node.create_client(AddTwoInts, HOLD_SERVICE)
        counter = node.create_client(AddTwoInts, COUNT_SERVICE)
        if not await counter.wait_for_service(WAIT_S):
            raise RuntimeError("nobody holds requests")
        calls = [client.call_async(AddTwoInts.Request(), None) for _ in range(wanted)]
        there = (await counter.call(AddTwoInts.Request())).sum  # requests keep their order
        if there != wanted:
            raise RuntimeError(f"{there} of {wanted} requests are pending")
        await parent.ready()
        load = Load()
        await parent.gone()
        left = sum(not call.done() for call in calls)
        return load.figures(left)
