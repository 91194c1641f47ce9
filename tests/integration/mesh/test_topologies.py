"""Brokers in any topology are one graph, in which each message arrives once."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import DEADLINE_SEC, free_port
from tests.integration.mesh.stations import (
    NEVER_SILENT,
    MeshBroker,
    Station,
    check_again,
    check_traffic,
    make_brokers,
    start_all,
    wait_until_joined,
)

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System

LINE = ((), (0,), (1,), (2,))
RING = ((), (0,), (1,), (2, 0))
STAR = ((), (0,), (0,), (0,))
"""By broker, those to which it connects."""

ZENOH_ROUTER = """
import json, sys, threading, zenoh
config = zenoh.Config()
config.insert_json5("mode", json.dumps("router"))
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("listen/endpoints", json.dumps([sys.argv[1]]))
with zenoh.open(config):
    print("open", flush=True)
    threading.Event().wait()
"""


@pytest.mark.parametrize("topology", [LINE, STAR], ids=["line", "star"])
async def test_each_message_arrives_once_everywhere(
    system: System, stack: AsyncExitStack, topology: tuple[tuple[int, ...], ...]
) -> None:
    """All nodes of four brokers hear and call each other, and no broker hears itself."""
    stations = await start_all(make_brokers(system, topology), stack, *NEVER_SILENT)
    ignored = [(await each.node.get_broker_stats()).mesh.ignored for each in stations]
    await check_traffic(*stations)
    assert ignored == [(await each.node.get_broker_stats()).mesh.ignored for each in stations]


async def test_a_ring_survives_the_loss_of_a_broker(system: System, stack: AsyncExitStack) -> None:
    """Each message arrives once in a ring of four brokers; when one is killed, the others go on."""
    brokers = make_brokers(system, RING)
    stations = await start_all(brokers, stack, *NEVER_SILENT)
    await _wait_for_neighbours(stations, 2)
    await check_again(*stations)  # the last link of the ring changes routes
    await check_traffic(*stations)
    await brokers[1].kill()
    left = [stations[0], *stations[2:]]
    await wait_until_joined(*left)
    await check_again(*left)


async def _wait_for_neighbours(stations: list[Station], count: int) -> None:
    async with asyncio.timeout(DEADLINE_SEC):
        for each in stations:
            while len((await each.node.get_broker_stats()).mesh.neighbours.split()) < count:
                pass


async def test_a_zenoh_router_connects_brokers(system: System, stack: AsyncExitStack) -> None:
    """Two brokers that only know a plain Zenoh router between them are one graph while it runs."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = await system.python("-c", ZENOH_ROUTER, endpoint)
    await router.wait_for_line("open")
    stations = await start_all([MeshBroker(system, [endpoint]) for _ in range(2)], stack, *NEVER_SILENT)
    await check_traffic(*stations)
    await router.kill()
    for each in stations:
        await each.wait_until_alone(1)
    router = await system.python("-c", ZENOH_ROUTER, endpoint)
    await router.wait_for_line("open")
    await wait_until_joined(*stations)
    await check_again(*stations)


async def test_brokers_join_in_any_order(system: System, stack: AsyncExitStack) -> None:
    """A broker joins when the one to which it connects starts, and again when that has been restarted."""
    last, first = make_brokers(system, ((), (0,)))
    await first.start(*NEVER_SILENT)
    near = await stack.enter_async_context(Station("near", first.url))
    await near.call(near)
    await last.start(*NEVER_SILENT)
    far = await stack.enter_async_context(Station("far", last.url))
    await wait_until_joined(near, far)
    last.stop()
    await near.wait_until_alone(1)
    assert last.program is not None
    await last.program.wait_for_exit()  # nobody else can listen there before
    await last.start(*NEVER_SILENT)
    await wait_until_joined(near, far)
    await check_traffic(near, far)


async def test_domains_of_a_mesh_are_apart(system: System, stack: AsyncExitStack) -> None:
    """Nodes with the same names in two domains at two brokers do not meet those of the other domain."""
    brokers = make_brokers(system, ((), (0,)))
    await asyncio.gather(*(each.start(*NEVER_SILENT) for each in brokers))
    pairs = [
        [
            await stack.enter_async_context(Station(name, each.url, domain=domain))
            for name, each in zip(("near", "far"), brokers, strict=True)
        ]
        for domain in (0, 7)
    ]
    for pair in pairs:
        await wait_until_joined(*pair)
    await check_traffic(*pairs[0])
    assert not any(each.heard for each in pairs[1])
    await check_traffic(*pairs[1])
