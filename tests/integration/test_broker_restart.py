"""The broker is killed and restarted: nodes continue, and no message arrives twice."""

from __future__ import annotations

import asyncio
import re
import signal
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from tests.integration.conftest import System

LATCHED = actors.QoSProfile(depth=2, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def test_publisher_and_subscriber_continue(system: System) -> None:
    """After SIGKILL and a restart messages arrive again, in rising order."""
    daemon = await system.broker()
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.wait_for_line("I heard")
    for _ in range(2):
        await daemon.kill()
        await publisher.wait_for_line("No broker at")
        await subscriber.wait_for_line("No broker at")
        daemon = await system.broker()
        await publisher.wait_for_line("Connected to the broker")
        await subscriber.wait_for_line("Connected to the broker")
        await subscriber.wait_for_line("I heard")
    numbers = [int(number) for number in re.findall(r"Addison: (\d+)", subscriber.output)]
    assert numbers == sorted(set(numbers))


async def test_a_server_continues(system: System) -> None:
    """The server serves clients of the new broker."""
    daemon = await system.broker()
    server = await system.example("add_two_ints_server")
    client = await system.example("add_two_ints_client", "1", "2")
    assert await client.wait_for_exit() == 0
    await daemon.kill()
    await server.wait_for_line("No broker at")
    await system.broker()
    client = await system.example("add_two_ints_client", "5", "3")
    await client.wait_for_line("Sum: 8")
    assert await client.wait_for_exit() == 0


async def test_a_client_continues(system: System) -> None:
    """Calls fail at once while there is no broker; wait_for_service waits for the new broker."""
    daemon = await system.broker()
    await system.example("add_two_ints_server")
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert await client.wait_for_service()
        assert (await client.call(AddTwoInts.Request(a=5, b=3))).sum == 8
        await daemon.kill()
        with pytest.raises(actors.ServiceUnavailable):
            async with asyncio.timeout(DEADLINE_SEC):
                await client.call(AddTwoInts.Request(a=5, b=3), timeout_sec=1000)
        await system.broker()
        assert await client.wait_for_service()
        assert (await client.call(AddTwoInts.Request(a=5, b=4))).sum == 9


async def test_messages_published_without_a_broker_are_kept_to_the_depth(system: System) -> None:
    """KEEP_LAST keeps its last `depth` messages until the broker and the subscriber are back."""
    daemon = await system.broker()
    async with (
        actors.Node("talker", url=system.url) as talker,
        actors.Node("hearer", url=system.url) as hearer,
    ):
        publisher = talker.create_publisher(String, "t", LATCHED)
        received = aiter(hearer.create_subscription(String, "t", qos_profile=LATCHED))
        publisher.publish(String(data="before"))
        assert (await anext(received)).data == "before"
        await daemon.kill()
        while talker.connected or hearer.connected:
            await asyncio.sleep(0)
        for i in range(5):
            publisher.publish(String(data=str(i)))
        await system.broker()
        assert [(await anext(received)).data for _ in range(2)] == ["3", "4"]
        publisher.publish(String(data="after"))
        assert (await anext(received)).data == "after"
        assert publisher.published == 7
        assert publisher.dropped == 3


async def test_latched_values_survive_the_broker(system: System) -> None:
    """The publisher sends its last messages to the new broker, which sends them to late joiners once."""
    daemon = await system.broker()
    async with (
        actors.Node("talker", url=system.url) as talker,
        actors.Node("hearer", url=system.url) as hearer,
    ):
        publisher = talker.create_publisher(String, "t", LATCHED)
        early = aiter(hearer.create_subscription(String, "t", qos_profile=LATCHED))
        for i in range(3):
            publisher.publish(String(data=str(i)))
            assert (await anext(early)).data == str(i)
        await daemon.kill()
        await system.broker()
        late = aiter(hearer.create_subscription(String, "t", qos_profile=LATCHED))
        assert [(await anext(late)).data for _ in range(2)] == ["1", "2"]
        publisher.publish(String(data="3"))
        assert (await anext(early)).data == "3"
        assert (await anext(late)).data == "3"


async def test_nodes_leave_a_frozen_broker_and_reconnect(system: System) -> None:
    """Case 35: nodes close the link after the keepalive limit, and reconnect when the broker continues."""
    daemon = await system.broker("--keepalive-sec", "0.6")
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.wait_for_line("I heard")
    daemon.send_signal(signal.SIGSTOP)
    await publisher.wait_for_line("silent")
    await subscriber.wait_for_line("silent")
    daemon.send_signal(signal.SIGCONT)
    await subscriber.wait_for_line("I heard")
    publisher.skip()
    await publisher.wait_for_line("Publishing")
    numbers = [int(number) for number in re.findall(r"Addison: (\d+)", subscriber.output)]
    assert numbers == sorted(set(numbers))
