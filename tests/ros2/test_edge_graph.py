"""ROS 2's graph as the edge of a bridge sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.edge import Edge
from tests.ros2.ros import WAIT_SEC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.ros2.conftest import Shared
    from tests.ros2.ros import Ros

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def other_edge(shared: Shared) -> Iterator[Edge]:
    """The edge of another bridge."""
    made = Edge(shared.network.environ, "other")
    yield made
    made.close()


async def test_nodes_and_endpoints_come_and_go(edge: Edge, ros: Ros, name: str) -> None:
    """Topics, services and clients of a native node are there as long as it has them."""
    there = await ros.node(f"{name}_there", "/inside")
    publisher = await there.publisher(f"/{name}/out", String)
    await there.subscription(f"/{name}/in", String)
    service = await there.service(f"/{name}/service", SetBool, SetBool.Response())
    await there.client(f"/{name}/call", SetBool)
    node = f"/inside/{name}_there"
    lasting = [(node, "subscription", f"/{name}/in"), (node, "client", f"/{name}/call")]
    short = [(node, "publisher", f"/{name}/out"), (node, "service", f"/{name}/service")]
    await edge.graph(*lasting, *short, nodes=[(node, "")])
    await publisher.destroy()
    await service.destroy()
    await edge.graph(*lasting, absent=short)
    await there.destroy()
    await edge.graph(absent=[(node,), *lasting])


async def test_endpoints_have_types_hashes_and_qos(edge: Edge, ros: Ros, name: str) -> None:
    """History and depth are unknown, and stand for the defaults."""
    there = await ros.node(f"{name}_there")
    await there.publisher(f"/{name}", String, LATCHED)
    found = await edge.ask("infos", f"/{name}", 1, WAIT_SEC)
    qos = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    assert found == [[there.name, "std_msgs/msg/String", type_hash(String), dict(qos.to_wire())]]
    await there.service(f"/{name}/service", SetBool, SetBool.Response())
    found = await edge.ask("infos", f"/{name}/service", 1, WAIT_SEC)
    assert found == [[there.name, "std_srvs/srv/SetBool", "", None]]


async def test_a_publisher_that_is_made_again_is_noticed(edge: Edge, ros: Ros, name: str) -> None:
    """The lists of its node are the same, and its QoS is another."""
    there = await ros.node(f"{name}_there")
    publisher = await there.publisher(f"/{name}", String)
    assert await edge.ask("durability", f"/{name}", "VOLATILE", WAIT_SEC)
    await publisher.destroy()
    await there.publisher(f"/{name}", String, LATCHED)
    assert await edge.ask("durability", f"/{name}", "TRANSIENT_LOCAL", WAIT_SEC)


async def test_mirrors_are_nodes_without_endpoints(edge: Edge, other_edge: Edge, ros: Ros, name: str) -> None:
    """Mirrors of this bridge and of another have their bridge's ID as origin; nothing of them is native."""
    there = await ros.node(f"{name}_there")
    await there.publisher(f"/{name}", String)
    for each in (edge, other_edge):
        node = await each.mirror(f"/{name}/{each.bridge_id}")
        await each.publisher(node, f"/{name}", String)
        await each.ask("service", node, f"/{name}/service", "std_srvs/srv/SetBool")
    nodes = [(f"/{name}/{each.bridge_id}", each.bridge_id) for each in (edge, other_edge)]
    _, endpoints = await edge.graph((there.name, "publisher", f"/{name}"), nodes=nodes)
    assert [each for each in endpoints if each[2].startswith(f"/{name}") and each[0] != there.name] == []


async def test_a_native_node_with_the_name_of_a_mirror(edge: Edge, ros: Ros, name: str) -> None:
    """It is not hidden, and only its own endpoints are its own: topics, services and clients."""
    node = await edge.mirror(f"/{name}")
    await edge.publisher(node, f"/{name}/mirror_topic", String)
    await edge.ask("service", node, f"/{name}/mirror_service", "std_srvs/srv/SetBool")
    there = await ros.node(name)
    await there.publisher(f"/{name}/topic", String)
    await there.service(f"/{name}/service", SetBool, SetBool.Response())
    await there.client(f"/{name}/call", SetBool)
    wanted = [
        (f"/{name}", kind, f"/{name}/{what}")
        for kind, what in (("publisher", "topic"), ("service", "service"), ("client", "call"))
    ]
    _, endpoints = await edge.graph(*wanted, nodes=[(f"/{name}", ""), (f"/{name}", edge.bridge_id)])
    assert [each for each in endpoints if "/mirror_" in each[2]] == []
    await edge.ask("destroy", node)
    await edge.graph(*wanted)


async def test_an_unchanged_graph_is_the_same_object(edge: Edge, ros: Ros, name: str) -> None:
    """So a bridge need not compare it."""
    there = await ros.node(f"{name}_there")
    await edge.graph(nodes=[(there.name, "")])
    assert await edge.ask("is_same_graph")
