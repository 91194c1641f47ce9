"""Who is there: the broker's truth reaches everybody, soon."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from tests.integration.conftest import System

SLEEPER = """
import asyncio
import actors

async def main():
    async with actors.Node("sleeper") as node:
        await node.get_graph()
        print("up", flush=True)
        await asyncio.sleep(3600)

actors.run(main)
"""

FORKER = """
import asyncio, os, sys, time
import actors
from actors.interfaces.std_msgs.msg import String

async def main():
    async with actors.Node("forker") as node:
        node.create_publisher(String, "t", 10)
        await node.get_graph()
        child = os.fork()
        if child == 0:
            print("child", flush=True)
            time.sleep(3600)
        await asyncio.sleep(3600)

actors.run(main)
"""


async def test_a_killed_process_disappears_at_once(system: System) -> None:
    """SIGKILL: its node, its publisher and its service are gone within a second."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    async with actors.Node("watcher", url=system.url) as node:
        assert await node.wait_for_node("/add_two_ints_server", timeout_sec=30)
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert await client.wait_for_service()
        await server.kill()
        start = time.monotonic()
        while "/add_two_ints_server" in await node.get_fully_qualified_node_names():
            assert time.monotonic() - start < 2.0
        assert not client.service_is_ready()
        assert await node.count_services("add_two_ints") == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
async def test_a_child_does_not_keep_its_dead_parent_in_the_graph(system: System) -> None:
    """A forked child closes its copy of the link: when the parent is killed, the node goes."""
    await system.broker()
    forker = await system.python("-c", FORKER)
    await forker.says("child")
    async with actors.Node("watcher", url=system.url) as node:
        assert await node.wait_for_node("/forker", timeout_sec=30)
        forker.process.kill()
        start = time.monotonic()
        while "/forker" in await node.get_fully_qualified_node_names():
            assert time.monotonic() - start < 2.0


async def test_a_frozen_server_fails_its_calls_and_comes_back(system: System) -> None:
    """After the keepalive limit its pending call fails; when it moves again it serves again."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        await client.wait_for_service()
        server.send(signal.SIGSTOP)
        start = time.monotonic()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(AddTwoInts.Request(a=1, b=1))
        assert time.monotonic() - start < 15.0
        assert not client.service_is_ready()
        assert await node.count_services("add_two_ints") == 0
        server.send(signal.SIGCONT)
        assert await client.wait_for_service(timeout_sec=30)
        assert (await client.call(AddTwoInts.Request(a=5, b=3))).sum == 8


async def test_a_frozen_node_that_nobody_is_matched_with_goes_when_somebody_asks(system: System) -> None:
    """Nobody relied on it, so nobody looked; a question for the graph has it looked at."""
    await system.broker("--keepalive-sec", "0.6")
    sleeper = await system.python("-c", SLEEPER)
    await sleeper.says("up")
    sleeper.send(signal.SIGSTOP)
    async with actors.Node("asker", url=system.url) as node:
        async with asyncio.timeout(20):
            while "/sleeper" in await node.get_fully_qualified_node_names():
                await asyncio.sleep(0.1)  # a question, and time for the answer to be missed
        sleeper.send(signal.SIGCONT)
        assert await node.wait_for_node("/sleeper", timeout_sec=20)


async def test_a_call_into_a_frozen_broker_ends_before_its_deadline(system: System) -> None:
    """Without a matched server nothing else told the caller that it depends on the broker."""
    daemon = await system.broker("--keepalive-sec", "0.6")
    async with actors.Node("caller", url=system.url) as node:
        client = node.create_client(AddTwoInts, "nobody")
        await node.get_graph()
        daemon.send(signal.SIGSTOP)
        start = time.monotonic()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(AddTwoInts.Request(a=1, b=1), timeout_sec=60)
        assert time.monotonic() - start < 30.0
        daemon.send(signal.SIGCONT)


async def test_a_frozen_subscriber_comes_back(system: System) -> None:
    """After the keepalive limit it is out of the graph; when it moves again it hears on."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber")
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(String, "addison", 10)
        async with asyncio.timeout(30):
            while publisher.get_subscription_count() == 0:
                await node.get_graph()
            publisher.publish(String(data="before"))
            await subscriber.says("before")
            subscriber.send(signal.SIGSTOP)
            while publisher.get_subscription_count() == 1:
                await node.get_graph()
        publisher.publish(String(data="unheard"))
        assert "/minimal_subscriber" not in await node.get_fully_qualified_node_names()
        subscriber.send(signal.SIGCONT)
        async with asyncio.timeout(30):
            while publisher.get_subscription_count() == 0:
                await node.get_graph()
        publisher.publish(String(data="after"))
        await subscriber.says("after")
        assert await subscriber.stop() == 0


async def test_wait_for_service_answers_the_moment_there_is_one(system: System) -> None:
    """A service that appears while somebody waits is seen long before the timeout."""
    await system.broker()
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert not await client.wait_for_service(timeout_sec=0.05)
        waiting = asyncio.create_task(client.wait_for_service(timeout_sec=60))
        server = await system.example("add_two_ints_server")
        assert await waiting
        server.send(signal.SIGTERM)
        assert await server.ends() == 0
        assert not await client.wait_for_service(timeout_sec=0)
