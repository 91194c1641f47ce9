"""SIGSTOP and SIGCONT, and loops that are blocked: who stands still is taken out, told so, and comes back."""

from __future__ import annotations

import asyncio
import signal
import time
from typing import TYPE_CHECKING

import pytest

import actors
import broker
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64, String
from tests.integration.counter import COUNTER, Counted

if TYPE_CHECKING:
    from tests.integration.conftest import System

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
SOON_SEC = 30.0
"""Long for any of these, on a machine that is busy with other tests, and far below a call's deadline."""
KEEPALIVE = ("--keepalive-sec", "0.6")
CROWD = 10_000
"""Messages that wait at a KEEP_ALL publisher when `ready` has to be waited for."""
BLOCKED_SEC = 2.5
"""How long a loop stands still: well above that."""

EMBEDDER = """
import asyncio, sys, time
import actors, broker
from actors.interfaces.std_msgs.msg import Int64

async def main():
    options = broker.BrokerOptions(port=int(sys.argv[1]), keepalive_sec=0.6)
    async with broker.Broker(options) as hub, actors.Node("embedded", url=hub.url) as node:
        publisher = node.create_publisher(Int64, "numbers", 10)
        print("up", flush=True)
        while publisher.get_subscription_count() < 1:
            await node.get_graph()
        publisher.publish(Int64(data=1))
        await publisher.flush()
        print("blocking", flush=True)
        time.sleep(float(sys.argv[2]))
        for number in range(2, 1_000_000):
            publisher.publish(Int64(data=number))
            await asyncio.sleep(0.02)

actors.run(main)
"""

SLOW_READER = """
import asyncio, sys, time
import actors
from actors.interfaces.std_msgs.msg import Int64

async def main():
    done = asyncio.Event()

    def slow(message):
        time.sleep(0.005)
        if message.data == int(sys.argv[1]) - 1:
            done.set()

    async with actors.Node("slow") as node:
        keep_all = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
        node.create_subscription(Int64, "numbers", slow, keep_all)
        await done.wait()

actors.run(main)
"""


async def matched(node: actors.Node, publisher: actors.Publisher[Int64], count: int = 1) -> None:
    """Wait until a publisher has exactly so many subscriptions."""
    async with asyncio.timeout(SOON_SEC):
        while publisher.get_subscription_count() != count:
            await node.get_graph()


async def test_a_reader_with_much_to_do_stays_in_the_graph(system: System) -> None:
    """Plain callbacks with messages queued for several keepalive limits do not make a node look silent."""
    crowd = 500
    await system.broker(*KEEPALIVE)
    reader = await system.python("-c", SLOW_READER, str(crowd))
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        await matched(node, publisher)
        for number in range(crowd):
            publisher.publish(Int64(data=number))
        await publisher.flush()
        counts: list[int] = []
        began = time.monotonic()
        async with asyncio.timeout(SOON_SEC):
            while time.monotonic() - began < 3 * 0.6:
                await node.get_graph()
                counts.append(publisher.get_subscription_count())
        assert set(counts) == {1}
        assert await reader.ends() == 0


async def test_a_frozen_reader_frees_the_publisher_that_waited_for_it(system: System) -> None:
    """After the keepalive limit its credit counts no more; back again it hears on and counts its losses."""
    await system.broker("--keepalive-sec", "2")
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        await matched(node, publisher)
        counter.send(signal.SIGSTOP)
        published = 0
        # On a very slow machine the reader may be out before its credit is used up: then nothing waits.
        while publisher.queued < CROWD and publisher.get_subscription_count():
            for _ in range(1000):
                publisher.publish(Int64(data=published))
                published += 1
            await asyncio.sleep(0)
        await publisher.ready(timeout_sec=SOON_SEC)
        await publisher.flush(timeout_sec=SOON_SEC)
        assert publisher.get_subscription_count() == 0
        counter.send(signal.SIGCONT)
        await matched(node, publisher)
        publisher.publish(Int64(data=-published))
        counted = Counted.read(await counter.says("counted"))
        assert counted.received + counted.lost_on_break == publisher.published
        assert counted.lost_on_break > 0


async def test_a_blocked_loop_is_suspended_and_comes_back(system: System) -> None:
    """Its caller hears at once that it is gone; the reply that comes too late is dropped; nothing is lost."""
    await system.broker(*KEEPALIVE)
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        client = node.create_client(AddTwoInts, "block")
        await matched(node, publisher)
        assert await client.wait_for_service(SOON_SEC)
        call = client.call_async(AddTwoInts.Request(a=round(1000 * BLOCKED_SEC)))
        await counter.says("blocking")
        publisher.publish(Int64(data=0))
        with pytest.raises(actors.ServiceUnavailable):
            await call
        assert "/counter" not in await node.get_fully_qualified_node_names()
        assert publisher.get_subscription_count() == 0
        publisher.publish(Int64(data=1))
        assert await client.wait_for_service(SOON_SEC)
        await matched(node, publisher)
        assert "/counter" in await node.get_fully_qualified_node_names()
        publisher.publish(Int64(data=-2))
        counted = Counted.read(await counter.says("counted"))
        assert counted.received + counted.lost_on_break == 3
        assert (await client.call(AddTwoInts.Request(a=1))).sum == 1


async def test_a_frozen_broker_loses_only_what_is_counted(system: System) -> None:
    """Nodes leave it, calls fail, all come back when it moves; no message twice, and the numbers add up."""
    daemon = await system.broker(*KEEPALIVE)
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", 100)
        client = node.create_client(AddTwoInts, "block")
        await matched(node, publisher)
        assert await client.wait_for_service(SOON_SEC)
        for number in range(100):
            publisher.publish(Int64(data=number))
        await publisher.flush()
        daemon.send(signal.SIGSTOP)
        call = client.call_async(AddTwoInts.Request(a=1), timeout_sec=1000)
        for number in range(100, 1000):
            publisher.publish(Int64(data=number))
            await asyncio.sleep(0)
        with pytest.raises(actors.ServiceUnavailable):
            async with asyncio.timeout(SOON_SEC):
                await call
        daemon.send(signal.SIGCONT)
        assert await client.wait_for_service(SOON_SEC)
        await matched(node, publisher)
        publisher.publish(Int64(data=-1000))
        counted = Counted.read(await counter.says("counted"))
        assert sum(counted) == publisher.published == 1001
        assert counted.received >= 100
        assert (await client.call(AddTwoInts.Request(a=1))).sum == 1


async def test_a_broker_frozen_for_a_moment_loses_nothing(system: System) -> None:
    """Shorter than the keepalive limit: no link breaks, no call fails, every message arrives."""
    daemon = await system.broker("--keepalive-sec", "20")
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        client = node.create_client(AddTwoInts, "block")
        await matched(node, publisher)
        assert await client.wait_for_service(SOON_SEC)
        for round_number in range(5):
            daemon.send(signal.SIGSTOP)
            call = client.call_async(AddTwoInts.Request(a=1))
            for number in range(1000):
                publisher.publish(Int64(data=1000 * round_number + number))
            await asyncio.sleep(0.05)
            daemon.send(signal.SIGCONT)
            assert (await call).sum == 1
        publisher.publish(Int64(data=-5000))
        assert Counted.read(await counter.says("counted")) == (5001, 0, 0)


async def test_a_broker_whose_process_blocks_is_left_and_found_again(system: System) -> None:
    """The loop it is embedded in stands still: nodes elsewhere reconnect, and hear on without a repeat."""
    embedder = await system.python("-c", EMBEDDER, str(system.port), str(BLOCKED_SEC))
    await embedder.says("up")
    async with actors.Node("hearer", url=system.url) as node:
        heard = aiter(node.create_subscription(Int64, "numbers", qos=10))
        client = node.create_client(AddTwoInts, "nobody")
        async with asyncio.timeout(SOON_SEC):
            assert (await anext(heard)).data == 1
            await embedder.says("blocking")
            with pytest.raises(actors.ServiceUnavailable):
                await client.call(AddTwoInts.Request(), timeout_sec=1000)
            numbers = [(await anext(heard)).data for _ in range(10)]
        assert numbers[0] > 1
        assert numbers == list(range(numbers[0], numbers[0] + 10))


async def test_a_node_that_blocks_the_broker_beside_it_is_not_thrown_out(system: System) -> None:
    """Broker and node share a loop that stood still: neither takes the other for dead."""
    options = broker.BrokerOptions(port=system.port, keepalive_sec=0.6)
    async with broker.Broker(options) as hub, actors.Node("node", url=hub.url) as node:
        heard = aiter(node.create_subscription(String, "t", qos=10))
        publisher = node.create_publisher(String, "t", 10)
        publisher.publish(String(data="before"))
        assert (await anext(heard)).data == "before"
        opened = hub.stats().connections
        time.sleep(BLOCKED_SEC)  # noqa: ASYNC251 - that is the fault
        publisher.publish(String(data="after"))
        async with asyncio.timeout(SOON_SEC):
            assert (await anext(heard)).data == "after"
            await asyncio.sleep(1.0)  # time enough for a wrong judgement
            publisher.publish(String(data="later"))
            assert (await anext(heard)).data == "later"
        assert hub.stats().connections == opened == 1
        assert [each.session for each in hub.link_stats()] == [1]
