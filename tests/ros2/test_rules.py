"""What may cross, under which names, and as which user."""

from __future__ import annotations

from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.ros2.graphs import graph_until, names_of, nodes_until
from tests.waiting import until

if TYPE_CHECKING:
    from tests.ros2.network import Network


async def test_what_is_denied_is_in_neither_graph(network: Network) -> None:
    """Topics and services of both sides: those that are allowed cross, the others are not shown."""
    network.broker()
    network.bridge("--allow", "/open/**", "--deny", "/open/secret")
    there = await network.ros().node("there")
    for name in ("/open/topic", "/open/secret", "/closed"):
        await there.publisher(name, String)
    await there.service("/open/service", Trigger, Trigger.Response())
    await there.service("/closed_service", Trigger, Trigger.Response())
    async with actors.Node("here", url=network.url) as here:
        for name in ("/open/topic", "/open/secret", "/closed"):
            here.create_subscription(String, name, print, 10)
        snapshot = await graph_until(
            here, lambda graph: "/open/service" in names_of(graph, "/there")["services"]
        )
        assert names_of(snapshot, "/there")["publishers"] == {"/open/topic": ["std_msgs/msg/String"]}
        assert [*names_of(snapshot, "/there")["services"]] == ["/open/service"]
        await there.endpoints("/open/topic", "subscriptions", 1)
        assert [*(await there.names_of("/here"))["subscriptions"]] == ["/open/topic"]


async def test_names_of_ros_are_below_the_namespace(network: Network) -> None:
    """Nodes, topics and services; a node here sees them with it, and one of ROS without it."""
    network.broker()
    network.bridge("--namespace", "/robot1")
    there = await network.ros().node("there", "/arm")
    publisher = await there.publisher("/arm/state", String)
    command = await there.subscription("/arm/command", String)
    await there.service("/arm/enable", Trigger, Trigger.Response(success=True))
    received: list[str] = []
    async with actors.Node("here", url=network.url) as here:
        here.create_subscription(String, "/robot1/arm/state", lambda each: received.append(each.data), 10)
        own = here.create_publisher(String, "/robot1/arm/command", 10)
        outside = here.create_publisher(String, "/arm/command", 10)
        client = here.create_client(Trigger, "/robot1/arm/enable")
        await nodes_until(here, "/robot1/arm/there")
        await publisher.matched()
        await publisher.publish(String(data="state"))
        await until(lambda: received == ["state"])
        await own.wait_for_subscriptions()
        await command.matched()
        outside.publish(String(data="outside"))
        own.publish(String(data="command"))
        assert await command.received(1) == [String(data="command")]
        assert await client.wait_for_service()
        assert (await client.call(Trigger.Request())).success
        await there.node_names("/here")
