"""Brokers of a mesh that are killed, restarted and stopped while their nodes talk."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.std_msgs.msg import String
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE, wait_for_subscriptions
from tests.integration.mesh.stations import (
    NEVER_SILENT,
    PERIOD_SEC,
    Station,
    check_again,
    make_brokers,
    start_all,
    wait_until_joined,
)

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System

PAIR = ((), (0,))
LINE = ((), (0,), (1,))


async def publish_for_ever(station: Station) -> None:
    """Publish as fast as the readers take it."""
    while True:
        try:
            station.publish(20)
        except actors.PublisherFull:
            await station.publisher.ready()
        await asyncio.sleep(0.002)


async def call_for_ever(station: Station, server: Station, ends: list[type[BaseException] | None]) -> None:
    """Call a server again and again; record how each call ends."""
    while True:
        try:
            await station.call(server)
        except actors.CallboardError as error:
            ends.append(type(error))
            await asyncio.sleep(PERIOD_SEC)
        else:
            ends.append(None)


async def test_a_broker_is_killed_and_restarted_under_load(system: System, stack: AsyncExitStack) -> None:
    """Its nodes come back; nothing arrives twice or out of order; calls fail as unavailable, or succeed."""
    brokers = make_brokers(system, LINE)
    stations = await start_all(brokers, stack)
    first, middle, last = stations
    ends: list[type[BaseException] | None] = []
    load = [asyncio.create_task(publish_for_ever(each)) for each in stations]
    load += [
        asyncio.create_task(call_for_ever(one, other, ends))
        for one, other in ((first, middle), (first, last), (middle, last), (last, first))
    ]
    try:
        for _ in range(2):
            await brokers[1].kill()
            await first.wait_until_alone(1)
            await last.wait_until_alone(1)
            await brokers[1].start()
            await wait_until_joined(*stations)
            seen = {(one.name, other.name): one.last(other) for one in stations for other in stations}
            for one in stations:
                for other in stations:
                    await one.wait_to_hear(other, seen[one.name, other.name] + 100)
    finally:
        for task in load:
            task.cancel()
        results = await asyncio.gather(*load, return_exceptions=True)
    assert {type(each) for each in results} == {asyncio.CancelledError}
    assert set(ends) == {None, actors.ServiceUnavailable}
    await check_again(*stations)


async def test_nodes_of_a_broker_that_stops_disappear_at_once(system: System, stack: AsyncExitStack) -> None:
    """Whether it stops or is killed, others do not wait for a lease or a keepalive."""
    brokers = make_brokers(system, PAIR)
    near, far = await start_all(brokers, stack, *NEVER_SILENT)
    for end in (brokers[1].stop, brokers[1].kill_now):
        end()
        async with asyncio.timeout(DEADLINE_SEC):
            await near.wait_until_alone(1)
            with pytest.raises(actors.ServiceUnavailable):
                await near.call(far)
            # Its endpoints go first, its name after them.
            while await near.node.get_fully_qualified_node_names() != [f"/{near.name}"]:
                await asyncio.sleep(0.01)
        assert brokers[1].program is not None
        await brokers[1].program.wait_for_exit()
        await brokers[1].start(*NEVER_SILENT)
        await wait_until_joined(near, far)


async def test_a_frozen_broker_is_gone_until_it_goes_on(system: System, stack: AsyncExitStack) -> None:
    """Others notice its silence; later nothing arrives twice or out of order."""
    brokers = make_brokers(system, PAIR)
    near, far = await start_all(brokers, stack, *NO_KEEPALIVE, "--mesh-lease-sec", "1")
    frozen = brokers[1].program
    assert frozen is not None
    frozen.send_signal(signal.SIGSTOP)
    with pytest.raises(actors.ServiceUnavailable):
        await near.call(far)
    await near.wait_until_alone(1)
    near.publish(100)
    far.publish(100)
    frozen.send_signal(signal.SIGCONT)
    await wait_until_joined(near, far)
    await check_again(near, far)


async def test_a_broker_that_stops_sends_what_it_has_accepted(system: System, stack: AsyncExitStack) -> None:
    """Also what waits because the other broker is slow."""
    total = 700
    brokers = make_brokers(system, PAIR)
    await asyncio.gather(*(each.start(*NO_KEEPALIVE, "--mesh-lease-sec", "60") for each in brokers))
    talker = await stack.enter_async_context(actors.Node("talker", url=brokers[0].url))
    hearer = await stack.enter_async_context(actors.Node("hearer", url=brokers[1].url))
    publisher = talker.create_publisher(String, "large", total)
    messages = aiter(hearer.create_subscription(String, "large", qos_profile=total))
    await wait_for_subscriptions(publisher)
    slow, stopping = brokers[1].program, brokers[0].program
    assert slow is not None
    assert stopping is not None
    slow.send_signal(signal.SIGSTOP)
    for number in range(total):
        publisher.publish(String(data=f"{number} {40_000 * 'x'}"))
    await publisher.flush(DEADLINE_SEC)
    brokers[0].stop()
    slow.send_signal(signal.SIGCONT)
    numbers: list[int] = []
    with suppress(TimeoutError):
        async with asyncio.timeout(DEADLINE_SEC):
            while len(numbers) < total:
                numbers.append(int((await anext(messages)).data.split()[0]))
    assert numbers == list(range(total)), f"{len(numbers)} of them\n{stopping.output}\n{slow.output}"
    assert await stopping.wait_for_exit() == 0
