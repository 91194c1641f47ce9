"""Brokers on computers whose network is slow, loses packets, or is cut."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING

import pytest

import actors
from tests.integration.mesh.computers import Computers, reason_without_computers
from tests.integration.mesh.stations import KEPT, MeshBroker, Station, check_again, check_traffic, start_all

if TYPE_CHECKING:
    from contextlib import AsyncExitStack
    from pathlib import Path

    from tests.integration.conftest import System

LEASE_SEC = 3.0
LATE_SEC = 6.0
"""What a busy machine may add; together less than Zenoh's own lease of 10 s."""


@pytest.fixture(autouse=True, scope="module")
def _skip() -> None:
    """Skip these tests where they cannot run."""
    reason = reason_without_computers()
    if reason:
        pytest.skip(reason)


async def start_on(
    computers: Computers, system: System, stack: AsyncExitStack, folder: Path
) -> list[Station]:
    """Start a broker on each computer, which all connect to the first, and a station at each."""
    await stack.enter_async_context(computers)
    brokers: list[MeshBroker] = []
    for i, address in enumerate(computers.addresses):
        to = brokers[:1]
        unix = folder / f"{i}.sock"
        brokers.append(MeshBroker(system, to, host=address, unix=unix, prefix=computers.command(i)))
    return await start_all(brokers, stack)


async def test_a_slow_network_that_loses_packets_loses_no_message(
    system: System, stack: AsyncExitStack, tmp_path: Path
) -> None:
    """With 20 ms of delay and 1 % of loss each message arrives once, and calls work."""
    computers = Computers(3, delay_sec=0.02, loss=0.01)
    stations = await start_on(computers, system, stack, tmp_path)
    for each in stations:
        each.publish(100, 5000 * "x")
    await check_traffic(*stations, count=500)
    assert computers.lost


async def test_a_cut_cable_parts_the_graph_until_it_is_repaired(
    system: System, stack: AsyncExitStack, tmp_path: Path
) -> None:
    """Each side goes on alone and calls to the other fail; healed, readers get the last latched values."""
    computers = Computers(3)
    stations = await start_on(computers, system, stack, tmp_path)
    near, also_near, far = stations
    await check_traffic(*stations)
    for each in stations:
        each.keep(KEPT)
    computers.cut(2)
    cut_at = time.monotonic()
    ends = await asyncio.gather(near.call(far), far.call(also_near), return_exceptions=True)
    assert [type(each) for each in ends] == [actors.ServiceUnavailable] * 2
    assert time.monotonic() - cut_at < LEASE_SEC + LATE_SEC
    await asyncio.gather(near.wait_until_alone(2), also_near.wait_until_alone(2), far.wait_until_alone(1))
    assert time.monotonic() - cut_at < LEASE_SEC + LATE_SEC
    await check_again(near, also_near)
    await check_again(far)
    for each in stations:
        each.keep(2 * KEPT)
    computers.repair(2)
    await asyncio.gather(*(each.wait_until_alone(3) for each in stations))
    await check_again(*stations)
    for each in stations:
        for other in stations:
            await each.wait_to_keep(other)
            assert each.kept[other.name][-KEPT:] == list(range(2 * KEPT, 3 * KEPT))
            assert not each.wrong
