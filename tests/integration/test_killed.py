"""SIGKILL: messages sent before are delivered, calls fail at once, and no wait hangs."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64, String
from tests.integration.conftest import DEADLINE_SEC, free_port, wait_for_subscriptions
from tests.integration.counter import COUNTER, Counted

if TYPE_CHECKING:
    from tests.integration.conftest import System

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)

TALKER = """
import asyncio, sys
import actors
from actors.interfaces.std_msgs.msg import String

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)

async def main():
    async with actors.Node("talker") as node:
        publisher = node.create_publisher(String, "numbers", KEEP_ALL)
        while not publisher.get_subscription_count():
            await node.get_graph()
        for number in range(int(sys.argv[1])):
            publisher.publish(String(data=f"{number} " + 1000 * "x"))
        await publisher.flush()
        print("flushed", flush=True)
        await asyncio.Event().wait()

actors.run(main)
"""

STUCK_READER = """
import time
import actors
from actors.interfaces.std_msgs.msg import String

class Stuck(actors.Node):
    @actors.subscription(String, "numbers", actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL))
    async def on_message(self, msg):
        print("stuck", flush=True)
        await actors_never()

import asyncio
async def actors_never():
    await asyncio.Event().wait()

actors.run(lambda: Stuck("stuck"))
"""

SILENT_SERVER = """
import asyncio
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts

class Silent(actors.Node):
    def __init__(self):
        super().__init__("silent")
        self.called = 0
        self.create_service(AddTwoInts, "silent", self.never, concurrent=True)

    async def never(self, request):
        self.called += 1
        if self.called == request.b:
            print("all called", flush=True)
        await asyncio.Event().wait()

actors.run(Silent)
"""


async def test_messages_flushed_before_a_kill_still_arrive(system: System) -> None:
    """Messages queued in the broker for a slow reader survive their publisher, in order."""
    total = 2000
    await system.broker()
    async with actors.Node("hearer", url=system.url) as node:
        received: list[int] = []
        busy, go_on, done = asyncio.Event(), asyncio.Event(), asyncio.Event()

        async def on_message(msg: String) -> None:
            busy.set()
            await go_on.wait()
            received.append(int(msg.data.split()[0]))
            if len(received) == total:
                done.set()

        subscription = node.create_subscription(String, "numbers", on_message, KEEP_ALL)
        talker = await system.python("-c", TALKER, str(total))
        await talker.wait_for_line("flushed")
        await busy.wait()
        await talker.kill()
        async with asyncio.timeout(DEADLINE_SEC):
            while subscription.get_publisher_count():
                await node.get_graph()
            go_on.set()
            await done.wait()
        assert received == list(range(total))
        assert "/talker" not in await node.get_fully_qualified_node_names()


async def test_a_killed_reader_releases_the_publisher_that_waited_for_it(system: System) -> None:
    """A KEEP_ALL publisher without credit continues as soon as the reader is dead."""
    await system.broker()
    stuck = await system.python("-c", STUCK_READER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(String, "numbers", KEEP_ALL)
        await wait_for_subscriptions(publisher)
        message = String(data=100_000 * "x")
        full = False
        async with asyncio.timeout(DEADLINE_SEC):
            while not full:
                try:
                    publisher.publish(message)
                    await node.get_graph()
                except actors.PublisherFull:
                    full = True
        await stuck.wait_for_line("stuck")
        await stuck.kill()
        await publisher.ready(timeout_sec=DEADLINE_SEC)
        await publisher.flush(timeout_sec=DEADLINE_SEC)
        assert publisher.queued == 0
        assert publisher.dropped == 0


async def test_every_call_fails_at_once_when_the_broker_is_killed(system: System) -> None:
    """Case 35: a thousand calls of ten nodes end with ServiceUnavailable, and none stays pending."""
    nodes, calls = 10, 100
    daemon = await system.broker()
    server = await system.python("-c", SILENT_SERVER)
    callers = [actors.Node(f"caller_{i}", url=system.url) for i in range(nodes)]
    async with asyncio.timeout(DEADLINE_SEC), asyncio.TaskGroup() as group:
        stop = asyncio.Event()
        ready = [asyncio.Event() for _ in callers]
        ends: list[BaseException] = []

        async def call(node: actors.Node, waiting: asyncio.Event) -> None:
            async with node:
                client = node.create_client(AddTwoInts, "silent")
                await client.wait_for_service()
                pending = [
                    client.call_async(AddTwoInts.Request(a=0, b=nodes * calls), timeout_sec=1000)
                    for _ in range(calls)
                ]
                waiting.set()
                ends.extend(
                    end
                    for end in await asyncio.gather(*pending, return_exceptions=True)
                    if isinstance(end, BaseException)
                )
                assert client.pending == 0
                await stop.wait()

        for node, waiting in zip(callers, ready, strict=True):
            group.create_task(call(node, waiting))
        for waiting in ready:
            await waiting.wait()
        await server.wait_for_line("all called")
        await daemon.kill()
        while len(ends) < nodes * calls:
            await asyncio.sleep(0)
        stop.set()
    assert {type(end) for end in ends} == {actors.ServiceUnavailable}
    await server.wait_for_line("No broker at")


async def test_a_message_cut_off_by_a_kill_is_discarded(system: System) -> None:
    """An incomplete large message is not delivered; other topics of the reader continue."""
    await system.broker()
    async with actors.Node("hearer", url=system.url) as hearer:
        halves = hearer.create_subscription(String, "large", qos_profile=10)
        beside = aiter(hearer.create_subscription(Int64, "small", qos_profile=10))
        for _ in range(5):
            talker = await system.python("-c", LARGE_TALKER)
            await talker.wait_for_line("publishing")
            await talker.kill()
        async with actors.Node("other", url=system.url) as other:
            publisher = other.create_publisher(Int64, "small", 10)
            async with asyncio.timeout(DEADLINE_SEC):
                await wait_for_subscriptions(publisher)
                publisher.publish(Int64(data=1))
                assert (await anext(beside)).data == 1
        assert halves.undecodable == 0
        assert hearer.connected


LARGE_TALKER = """
import asyncio
import actors
from actors.interfaces.std_msgs.msg import String

async def main():
    async with actors.Node("talker") as node:
        publisher = node.create_publisher(String, "large", 10)
        while not publisher.get_subscription_count():
            await node.get_graph()
        message = String(data=30_000_000 * "x")
        publisher.publish(message)
        print("publishing", flush=True)
        while True:
            publisher.publish(message)
            await asyncio.sleep(0)

actors.run(main)
"""


async def test_nodes_move_to_the_second_broker(system: System) -> None:
    """With two URLs, topics and calls work at the second broker after the first is killed."""
    first = await system.broker()
    place = system.url
    system.port = free_port()
    system.url = f"callboard://127.0.0.1:{system.port}"
    await system.broker()
    system.url = f"{place},{system.url}"
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        client = node.create_client(AddTwoInts, "block")
        async with asyncio.timeout(DEADLINE_SEC):
            for number in range(3):
                assert await client.wait_for_service()
                await wait_for_subscriptions(publisher)
                publisher.publish(Int64(data=number))
                assert (await client.call(AddTwoInts.Request(a=1))).sum == 1
                if number == 0:
                    await first.kill()
                    while client.service_is_ready():
                        await asyncio.sleep(0)
        publisher.publish(Int64(data=-3))
        counted = Counted.read(await counter.wait_for_line("counted"))
        assert sum(counted) == publisher.published == 4
        assert counted.received >= 3
    assert "No broker at" not in counter.output
