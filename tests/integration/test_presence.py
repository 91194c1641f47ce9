"""Presence: nodes soon learn which other nodes the broker has."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE, wait_for_subscriptions

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
    """After SIGKILL its node and service leave the graph without the keepalive."""
    await system.broker(*NO_KEEPALIVE)
    server = await system.example("add_two_ints_server")
    async with actors.Node("watcher", url=system.url) as node:
        assert await node.wait_for_node("/add_two_ints_server", timeout_sec=DEADLINE_SEC)
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert await client.wait_for_service()
        await server.kill()
        async with asyncio.timeout(DEADLINE_SEC):
            while "/add_two_ints_server" in await node.get_fully_qualified_node_names():
                pass
        assert not client.service_is_ready()
        assert await node.count_services("add_two_ints") == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
async def test_a_child_does_not_keep_its_killed_parent_in_the_graph(system: System) -> None:
    """A forked child closes its copy of the socket: when the parent is killed, its node leaves."""
    await system.broker(*NO_KEEPALIVE)
    forker = await system.python("-c", FORKER)
    await forker.wait_for_line("child")
    async with actors.Node("watcher", url=system.url) as node:
        assert await node.wait_for_node("/forker", timeout_sec=DEADLINE_SEC)
        forker.process.kill()
        async with asyncio.timeout(DEADLINE_SEC):
            while "/forker" in await node.get_fully_qualified_node_names():
                pass


async def test_a_frozen_server_fails_its_calls_and_comes_back(system: System) -> None:
    """After the keepalive limit its pending call fails; when it continues it serves again."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        await client.wait_for_service()
        server.send_signal(signal.SIGSTOP)
        with pytest.raises(actors.ServiceUnavailable):
            async with asyncio.timeout(DEADLINE_SEC):
                await client.call(AddTwoInts.Request(a=1, b=1), timeout_sec=1000)
        assert not client.service_is_ready()
        assert await node.count_services("add_two_ints") == 0
        server.send_signal(signal.SIGCONT)
        assert await client.wait_for_service(timeout_sec=DEADLINE_SEC)
        assert (await client.call(AddTwoInts.Request(a=5, b=3))).sum == 8


async def test_a_frozen_node_without_matches_leaves_after_a_graph_query(system: System) -> None:
    """No node depends on it, so the broker checks it rarely; a graph query makes the broker check it."""
    await system.broker()
    sleeper = await system.python("-c", SLEEPER)
    await sleeper.wait_for_line("up")
    sleeper.send_signal(signal.SIGSTOP)
    async with actors.Node("asker", url=system.url) as node:
        async with asyncio.timeout(DEADLINE_SEC):
            while "/sleeper" in await node.get_fully_qualified_node_names():
                await asyncio.sleep(0.1)  # between queries; the keepalive needs time
        sleeper.send_signal(signal.SIGCONT)
        assert await node.wait_for_node("/sleeper", timeout_sec=DEADLINE_SEC)


async def test_a_call_into_a_frozen_broker_ends_before_its_deadline(system: System) -> None:
    """The caller's keepalive notices it, although no server is matched."""
    daemon = await system.broker()
    async with actors.Node("caller", url=system.url) as node:
        client = node.create_client(AddTwoInts, "nobody")
        await node.get_graph()
        daemon.send_signal(signal.SIGSTOP)
        with pytest.raises(actors.ServiceUnavailable):
            async with asyncio.timeout(DEADLINE_SEC):
                await client.call(AddTwoInts.Request(a=1, b=1), timeout_sec=1000)
        daemon.send_signal(signal.SIGCONT)


async def test_a_frozen_subscriber_comes_back(system: System) -> None:
    """After the keepalive limit it leaves the graph; when it continues it receives messages again."""
    await system.broker()
    subscriber = await system.example("minimal_subscriber")
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(String, "addison", 10)
        await wait_for_subscriptions(publisher)
        publisher.publish(String(data="before"))
        await subscriber.wait_for_line("before")
        subscriber.send_signal(signal.SIGSTOP)
        await wait_for_subscriptions(publisher, 0)
        publisher.publish(String(data="unheard"))
        assert "/minimal_subscriber" not in await node.get_fully_qualified_node_names()
        subscriber.send_signal(signal.SIGCONT)
        await wait_for_subscriptions(publisher)
        publisher.publish(String(data="after"))
        await subscriber.wait_for_line("after")
        assert await subscriber.stop() == 0


async def test_wait_for_service_returns_when_a_server_appears(system: System) -> None:
    """It returns long before the timeout when a server starts while it waits."""
    await system.broker()
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert not await client.wait_for_service(timeout_sec=0.05)
        waiting = asyncio.create_task(client.wait_for_service(timeout_sec=60))
        server = await system.example("add_two_ints_server")
        assert await waiting
        server.send_signal(signal.SIGTERM)
        assert await server.wait_for_exit() == 0
        assert not await client.wait_for_service(timeout_sec=0)
