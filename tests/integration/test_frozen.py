"""Frozen processes (SIGSTOP) and blocked loops are suspended, notified, and come back."""

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
from proto.limits import DEFAULT_KEEPALIVE_SEC
from tests.integration.conftest import DEADLINE_SEC, wait_for_subscriptions
from tests.integration.counter import COUNTER, Counted

if TYPE_CHECKING:
    from tests.integration.conftest import System

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
CROWD = 10_000
"""Messages queued at a KEEP_ALL publisher that has used up its credit."""

EMBEDDER = """
import asyncio, signal, sys
import actors, broker
from actors.interfaces.std_msgs.msg import Int64

async def main():
    options = broker.BrokerOptions(port=int(sys.argv[1]))
    async with broker.Broker(options) as hub, actors.Node("embedded", url=hub.url) as node:
        publisher = node.create_publisher(Int64, "numbers", 10)
        print("up", flush=True)
        while publisher.get_subscription_count() < 1:
            await node.get_graph()
        publisher.publish(Int64(data=1))
        await publisher.flush()
        print("blocking", flush=True)
        signal.sigwait([signal.SIGUSR1])
        for number in range(2, 1_000_000):
            publisher.publish(Int64(data=number))
            await asyncio.sleep(0.02)

signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
actors.run(main)
"""
"""Publishes, blocks its loop until SIGUSR1, and publishes again."""

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


async def test_a_reader_with_much_to_do_stays_in_the_graph(system: System) -> None:
    """Plain callbacks that take several keepalive limits in all do not make a node look silent."""
    crowd = 1400
    await system.broker()
    reader = await system.python("-c", SLOW_READER, str(crowd))
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        await wait_for_subscriptions(publisher)
        for number in range(crowd):
            publisher.publish(Int64(data=number))
        await publisher.flush()
        counts: list[int] = []
        began = time.monotonic()
        async with asyncio.timeout(DEADLINE_SEC):
            while time.monotonic() - began < 2 * DEFAULT_KEEPALIVE_SEC:
                await node.get_graph()
                counts.append(publisher.get_subscription_count())
        assert set(counts) == {1}
        assert await reader.wait_for_exit() == 0


async def test_a_frozen_reader_frees_the_publisher_that_waited_for_it(system: System) -> None:
    """After the keepalive limit its credit no longer counts; when it is back it counts what it missed."""
    await system.broker()
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        await wait_for_subscriptions(publisher)
        counter.send_signal(signal.SIGSTOP)
        published = 0
        # On a very slow machine the reader may be suspended before its credit is used up.
        while publisher.queued < CROWD and publisher.get_subscription_count():
            for _ in range(1000):
                publisher.publish(Int64(data=published))
                published += 1
            await asyncio.sleep(0)
        await publisher.ready(timeout_sec=DEADLINE_SEC)
        await publisher.flush(timeout_sec=DEADLINE_SEC)
        assert publisher.get_subscription_count() == 0
        counter.send_signal(signal.SIGCONT)
        await wait_for_subscriptions(publisher)
        publisher.publish(Int64(data=-published))
        counted = Counted.read(await counter.wait_for_line("counted"))
        assert counted.received + counted.lost_on_break == publisher.published
        assert counted.lost_on_break > 0


async def test_a_blocked_loop_is_suspended_and_comes_back(system: System) -> None:
    """Its caller gets an error, its late reply is dropped, and its counters account for every message."""
    await system.broker()
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        client = node.create_client(AddTwoInts, "block")
        await wait_for_subscriptions(publisher)
        assert await client.wait_for_service(DEADLINE_SEC)
        call = client.call_async(AddTwoInts.Request(a=-1), timeout_sec=1000)
        await counter.wait_for_line("blocking")
        publisher.publish(Int64(data=0))
        with pytest.raises(actors.ServiceUnavailable):
            await call
        assert "/counter" not in await node.get_fully_qualified_node_names()
        assert publisher.get_subscription_count() == 0
        publisher.publish(Int64(data=1))
        counter.send_signal(signal.SIGUSR1)
        assert await client.wait_for_service(DEADLINE_SEC)
        await wait_for_subscriptions(publisher)
        assert "/counter" in await node.get_fully_qualified_node_names()
        publisher.publish(Int64(data=-2))
        counted = Counted.read(await counter.wait_for_line("counted"))
        assert counted.received + counted.lost_on_break == 3
        assert (await client.call(AddTwoInts.Request(a=1))).sum == 1


async def test_a_frozen_broker_loses_only_what_is_counted(system: System) -> None:
    """Calls fail, nodes reconnect afterwards, no message arrives twice, and the counts add up."""
    daemon = await system.broker()
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", 100)
        client = node.create_client(AddTwoInts, "block")
        await wait_for_subscriptions(publisher)
        assert await client.wait_for_service(DEADLINE_SEC)
        for number in range(99):
            publisher.publish(Int64(data=number))
        publisher.publish(Int64(data=-99))
        assert Counted.read(await counter.wait_for_line("counted")) == (100, 0, 0)
        daemon.send_signal(signal.SIGSTOP)
        call = client.call_async(AddTwoInts.Request(a=1), timeout_sec=1000)
        for number in range(100, 1000):
            publisher.publish(Int64(data=number))
            await asyncio.sleep(0)
        with pytest.raises(actors.ServiceUnavailable):
            async with asyncio.timeout(DEADLINE_SEC):
                await call
        daemon.send_signal(signal.SIGCONT)
        assert await client.wait_for_service(DEADLINE_SEC)
        await wait_for_subscriptions(publisher)
        publisher.publish(Int64(data=-1000))
        counted = Counted.read(await counter.wait_for_line("counted"))
        assert sum(counted) == publisher.published == 1001
        assert counted.received >= 100
        assert (await client.call(AddTwoInts.Request(a=1))).sum == 1


async def test_a_broker_frozen_for_less_than_the_keepalive_limit_loses_nothing(system: System) -> None:
    """No connection breaks, no call fails, and every message arrives."""
    daemon = await system.broker("--keepalive-sec", "20")
    counter = await system.python("-c", COUNTER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        client = node.create_client(AddTwoInts, "block")
        await wait_for_subscriptions(publisher)
        assert await client.wait_for_service(DEADLINE_SEC)
        for round_number in range(5):
            daemon.send_signal(signal.SIGSTOP)
            call = client.call_async(AddTwoInts.Request(a=1))
            for number in range(1000):
                publisher.publish(Int64(data=1000 * round_number + number))
            await asyncio.sleep(0.05)
            daemon.send_signal(signal.SIGCONT)
            assert (await call).sum == 1
        publisher.publish(Int64(data=-5000))
        assert Counted.read(await counter.wait_for_line("counted")) == (5001, 0, 0)


async def test_nodes_leave_a_broker_whose_process_blocks_and_reconnect(system: System) -> None:
    """The loop that embeds the broker is blocked: remote nodes reconnect and receive nothing twice."""
    embedder = await system.python("-c", EMBEDDER, str(system.port))
    await embedder.wait_for_line("up")
    async with actors.Node("hearer", url=system.url) as node:
        received = aiter(node.create_subscription(Int64, "numbers", qos_profile=1000))  # none is dropped
        client = node.create_client(AddTwoInts, "nobody")
        async with asyncio.timeout(DEADLINE_SEC):
            assert (await anext(received)).data == 1
            await embedder.wait_for_line("blocking")
            with pytest.raises(actors.ServiceUnavailable):
                await client.call(AddTwoInts.Request(), timeout_sec=1000)
            embedder.send_signal(signal.SIGUSR1)
            numbers = [(await anext(received)).data for _ in range(10)]
        assert numbers[0] > 1
        assert numbers == list(range(numbers[0], numbers[0] + 10))


async def test_a_node_that_blocks_the_broker_in_its_loop_stays_connected(system: System) -> None:
    """Broker and node share a loop that was blocked: neither takes the other for dead."""
    options = broker.BrokerOptions(port=system.port, keepalive_sec=0.3)
    async with broker.Broker(options) as hub, actors.Node("node", url=hub.url) as node:
        received = aiter(node.create_subscription(String, "t", qos_profile=10))
        publisher = node.create_publisher(String, "t", 10)
        publisher.publish(String(data="before"))
        assert (await anext(received)).data == "before"
        opened = hub.stats().connections
        time.sleep(1)  # noqa: ASYNC251 - that is the fault
        publisher.publish(String(data="after"))
        async with asyncio.timeout(DEADLINE_SEC):
            assert (await anext(received)).data == "after"
            await asyncio.sleep(0.5)  # longer than the keepalive limit: a wrong suspension would show
            publisher.publish(String(data="later"))
            assert (await anext(received)).data == "later"
        assert hub.stats().connections == opened == 1
        assert [each.session for each in hub.link_stats()] == [1]
