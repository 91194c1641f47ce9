"""The broker is killed and comes back: everybody goes on, nobody sees a message twice."""

from __future__ import annotations

import asyncio
import re
import signal
import time
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from tests.integration.conftest import System

LATCHED = actors.QoSProfile(depth=2, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def test_publisher_and_subscriber_go_on(system: System) -> None:
    """After SIGKILL and a new start messages flow again; numbers only grow."""
    daemon = await system.broker()
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.says("I heard")
    for _ in range(2):
        await daemon.kill()
        await publisher.says("No broker at")
        await subscriber.says("No broker at")
        daemon = await system.broker()
        await publisher.says("Connected to the broker")
        await subscriber.says("Connected to the broker")
        await subscriber.says("I heard")
    numbers = [int(number) for number in re.findall(r"Addison: (\d+)", subscriber.output)]
    assert numbers == sorted(set(numbers))


async def test_server_goes_on(system: System) -> None:
    """The server serves clients of the new broker."""
    daemon = await system.broker()
    server = await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", "1", "2")
    assert await client.ends() == 0
    await daemon.kill()
    await server.says("No broker at")
    await system.broker()
    client = await system.example("add_two_ints_client", "5", "3")
    await client.says("Sum: 8")
    assert await client.ends() == 0


async def test_client_goes_on(system: System) -> None:
    """Calls fail at once while there is no broker; waiting for the service spans the gap."""
    daemon = await system.broker()
    await system.example("add_two_ints_server")
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert await client.wait_for_service()
        assert (await client.call(AddTwoInts.Request(a=5, b=3))).sum == 8
        await daemon.kill()
        start = time.monotonic()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(AddTwoInts.Request(a=5, b=3))
        assert time.monotonic() - start < 2.0
        await system.broker()
        assert await client.wait_for_service()
        assert (await client.call(AddTwoInts.Request(a=5, b=4))).sum == 9


async def test_messages_published_meanwhile_are_kept_to_the_depth(system: System) -> None:
    """KEEP_LAST keeps its last `depth` messages until the broker and the subscriber are back."""
    daemon = await system.broker()
    async with (
        actors.Node("talker", url=system.url) as talker,
        actors.Node("hearer", url=system.url) as hearer,
    ):
        publisher = talker.create_publisher(String, "t", LATCHED)
        heard = aiter(hearer.create_subscription(String, "t", qos=LATCHED))
        publisher.publish(String(data="before"))
        assert (await anext(heard)).data == "before"
        await daemon.kill()
        while talker.connected or hearer.connected:
            await asyncio.sleep(0)
        for i in range(5):
            publisher.publish(String(data=str(i)))
        await system.broker()
        assert [(await anext(heard)).data for _ in range(2)] == ["3", "4"]
        publisher.publish(String(data="after"))
        assert (await anext(heard)).data == "after"
        assert publisher.published == 7
        assert publisher.dropped == 3


async def test_latched_values_survive_the_broker(system: System) -> None:
    """The publisher gives its last messages to a new broker, which gives them to late joiners, once."""
    daemon = await system.broker()
    async with (
        actors.Node("talker", url=system.url) as talker,
        actors.Node("hearer", url=system.url) as hearer,
    ):
        publisher = talker.create_publisher(String, "t", LATCHED)
        early = aiter(hearer.create_subscription(String, "t", qos=LATCHED))
        for i in range(3):
            publisher.publish(String(data=str(i)))
            assert (await anext(early)).data == str(i)
        await daemon.kill()
        await system.broker()
        late = aiter(hearer.create_subscription(String, "t", qos=LATCHED))
        assert [(await anext(late)).data for _ in range(2)] == ["1", "2"]
        publisher.publish(String(data="3"))
        assert (await anext(early)).data == "3"
        assert (await anext(late)).data == "3"


async def test_a_frozen_broker_is_noticed_and_forgiven(system: System) -> None:
    """A broker that stands still for longer than the keepalive is left; all goes on when it moves again."""
    daemon = await system.broker()
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.says("I heard")
    daemon.send(signal.SIGSTOP)
    await publisher.says("silent")
    await subscriber.says("silent")
    daemon.send(signal.SIGCONT)
    await subscriber.says("I heard")
    publisher.skip()
    await publisher.says("Publishing")
    numbers = [int(number) for number in re.findall(r"Addison: (\d+)", subscriber.output)]
    assert numbers == sorted(set(numbers))
