"""Several bridges: one of them works, and nothing crosses twice."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import String
from proto.wire.codes import EntryKind
from tests.ros2.graphs import graph_until, nodes_until
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot
    from tests.ros2.network import Network


async def test_one_of_two_bridges_works_and_the_other_takes_over(network: Network) -> None:
    """Messages arrive once; after a SIGKILL of the one that works they arrive again, by the other."""
    network.broker()
    bridges = [network.bridge(), network.bridge()]
    there = await network.ros().node("there")
    publisher = await there.publisher("/text", String)
    received: list[str] = []
    async with actors.Node("here", url=network.url) as here:
        here.create_subscription(String, "/text", lambda each: received.append(each.data), 10)
        await publisher.matched(1)
        # Both bridges are there, and still only one shows the node.
        await graph_until(here, lambda graph: _count_bridges(graph) == 2)
        for text in ("one", "two"):
            await publisher.publish(String(data=text))
            await until(lambda: text in received)  # noqa: B023
        assert received == ["one", "two"]
        assert [key for key in await _nodes(here) if key == "/there"] == ["/there"]
        bridges[0].kill()
        await graph_until(here, lambda graph: _count_bridges(graph) == 1)
        await nodes_until(here, "/there")
        # The dead one's subscription stays for its lease; meanwhile messages are lost, but not doubled.
        for number in range(1000):
            await publisher.publish(String(data=str(number)))
            await asyncio.sleep(0.05)
            if str(number) in received:
                break
        assert len(received) == len({*received})
        assert received[2:]


async def _nodes(node: actors.Node) -> list[str]:
    """Return the names of the graph's nodes, one for each node."""
    return [each.node for each in (await node.get_graph()).of_kind(EntryKind.NODE)]


def _count_bridges(graph: GraphSnapshot) -> int:
    """Return how many bridges a graph shows."""
    return len({each["bridge_id"] for each in graph.node_labels().values() if "bridge_id" in each})


async def test_a_bridge_does_not_show_what_another_one_shows(make_network: Callable[[], Network]) -> None:
    """Two ROS networks at one broker: neither has nodes of the other, and callboard has all, once."""
    first, second = make_network(), make_network()
    first.broker()
    first.bridge()
    first.bridge(domain=second.domain)
    left, right = await first.ros().node("left"), await second.ros().node("right")
    publisher = await left.publisher("/text", String)
    stranger = await right.subscription("/text", String)
    received: list[str] = []
    async with actors.Node("here", url=first.url) as here:
        here.create_subscription(String, "/text", lambda each: received.append(each.data), 10)
        await nodes_until(here, "/left", "/right")
        for node in (left, right):
            await node.node_names("/here")
        await publisher.matched()
        await publisher.publish(String(data="text"))
        await until(lambda: received == ["text"])
        own = here.create_publisher(String, "/text", 10)
        await stranger.matched(1)
        own.publish(String(data="own"))
        assert await stranger.received(1) == [String(data="own")]
        assert "/right" not in await left.node_names()
        assert "/left" not in await right.node_names()
        assert received == ["text", "own"]


async def test_a_chain_of_two_meshes_ends(make_network: Callable[[], Network]) -> None:
    """Two brokers at one ROS network: nodes of callboard do not cross it, and nothing comes back."""
    first, second = make_network(), make_network()
    for each in (first, second):
        each.broker()
    first.bridge()
    first.bridge(url=second.url)
    ros = await first.ros().node("ros")
    subscription = await ros.subscription("/text", String)
    async with actors.Node("one", url=first.url) as one, actors.Node("two", url=second.url) as two:
        publisher = one.create_publisher(String, "/text", 10)
        for node in (one, two):
            await nodes_until(node, "/ros")
        await ros.node_names("/one", "/two")
        await publisher.wait_for_subscriptions(1)
        await subscription.matched(1)
        publisher.publish(String(data="text"))
        assert await subscription.received(1) == [String(data="text")]
        assert "/two" not in (await one.get_graph()).nodes()
        assert "/one" not in (await two.get_graph()).nodes()
