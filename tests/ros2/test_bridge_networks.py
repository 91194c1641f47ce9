"""Several bridges of one callboard graph, with real ROS 2: to two networks, and to one."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.bridges.ros2.participant import CONTROL_NODE
from actors.interfaces.std_msgs.msg import Int32, String

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.ros2.network import Network


async def test_what_has_crossed_one_bridge_does_not_cross_another(
    make_network: Callable[[], Network],
) -> None:
    """A message of one ROS network does not reach another, even if a native node here has its node's name."""
    robot, arm = make_network(), make_network()
    robot.broker()
    robot.bridge()
    arm.bridge(url=robot.url)
    listener = await (await robot.ros().node("listener")).subscription("/chatter", String)
    arm_talker = await (await arm.ros().node("talker")).publisher("/chatter", String)
    received: asyncio.Queue[str] = asyncio.Queue()
    async with actors.Node("talker", url=robot.url, shared_name=True) as talker:
        publisher = talker.create_publisher(String, "/chatter", 10)
        talker.create_subscription(String, "/chatter", lambda message: received.put_nowait(message.data), 10)
        # Both bridges let messages cross, and this one arrives here before the last one leaves.
        await listener.matched()
        await publisher.wait_for_subscriptions(2)
        await arm_talker.matched()
        await arm_talker.publish(String(data="arm"))
        assert await received.get() == "arm"
        publisher.publish(String(data="here"))
        assert await listener.received(1) == [String(data="here")]


async def test_another_bridge_takes_over(network: Network) -> None:
    """Of two bridges of one network one is active; after its SIGKILL the other one is. Nothing is doubled."""
    network.broker()
    first = network.bridge()
    ros = network.ros()
    node = await ros.node("listener")
    listener = await node.subscription("/count", Int32)
    async with actors.Node("counter", url=network.url) as counter:
        publisher = counter.create_publisher(Int32, "/count", 10)
        await listener.matched()
        await publisher.wait_for_subscriptions(1)
        network.bridge()
        while len(bridges := [each for each in await node.node_names() if CONTROL_NODE in each]) < 2:
            await asyncio.sleep(0.1)
        assert len(bridges) == 2
        for number in range(5):
            publisher.publish(Int32(data=number))
        assert [each.data for each in await listener.received(5)] == [*range(5)]
        first.kill()
        numbers: list[int] = []
        number = 5
        # What is published before the other one has taken over is lost.
        while not numbers or numbers[-1] < 5:
            publisher.publish(Int32(data=number))
            number += 1
            await asyncio.sleep(0.1)
            numbers = [each.data for each in await listener.received(5)]
        assert numbers == sorted(set(numbers))
