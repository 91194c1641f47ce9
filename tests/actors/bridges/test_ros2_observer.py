"""ROS 2's graph as a bridge reads it: when it asks, and what it makes of the answers."""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING

import pytest

from actors.bridges.graph import SideEndpoint, SideGraph, SideNode
from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.errors import RosError
from actors.bridges.ros2.observer import (
    INFOS_PER_POLL,
    READ_INTERVAL_PER_NODE_SEC,
    READ_INTERVAL_SEC,
    RESCAN_SEC,
    Observer,
)
from actors.bridges.ros2.participant import Participant
from actors.qos.profile import DurabilityPolicy, QoSProfile
from proto.wire.codes import EntryKind
from tests.actors.bridges.ros2_stand_in import OTHER, OWN, QOS, SERVICE_CLASS, Network, Shown, make_ros

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

pytestmark = pytest.mark.skipif(not hasattr(os, "eventfd"), reason="needs eventfd")

PUBLISHER, SUBSCRIPTION = EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION
SERVICE, CLIENT = EntryKind.SERVICE, EntryKind.CLIENT
STRING, SET_BOOL = "std_msgs/msg/String", "std_srvs/srv/SetBool"
BRIDGE = b"\x03" * 12
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Seen:
    """A network, and what an observer sees of it."""

    def __init__(self) -> None:
        self.network = Network()
        ros = make_ros(self.network)
        arrivals = Arrivals(ros, asyncio.get_running_loop(), print)
        self.participant = Participant(ros, bridge_id="one", arrivals=arrivals)
        self.observer = Observer(ros, self.participant)
        self.now = 0.0

    def poll(self, count: int = 1) -> SideGraph:
        """Poll so many times, some time after each other."""
        for _ in range(count):
            self.now += READ_INTERVAL_SEC
            graph = self.observer.poll(self.now)
        return graph

    def names(self, count: int = 1) -> set[tuple[str, str, str]]:
        """Poll, and return the endpoints: node, kind, name."""
        return {(each.node, each.kind.name.lower(), each.name) for each in self.poll(count).endpoints}


@pytest.fixture
async def seen() -> AsyncIterator[Seen]:
    """A network with the bridge's own node."""
    made = Seen()
    yield made
    made.participant.close()


async def test_native_nodes_and_their_endpoints(seen: Seen) -> None:
    """Topics have hashes and QoS, services do not; what the bridge shows is a node without endpoints."""
    seen.network.show("/a/b", (PUBLISHER, "/t", STRING), (SERVICE, "/s", SET_BOOL), (CLIENT, "/c", SET_BOOL))
    seen.participant.mirror_node("/mirror").create_publisher(str, "/t", QoSProfile(depth=1))
    graph = seen.poll()
    assert graph.nodes == {
        SideNode("/callboard_bridge_one", "one"),
        SideNode("/mirror", "one"),
        SideNode("/a/b"),
    }
    assert graph.endpoints == {
        SideEndpoint("/a/b", PUBLISHER, "/t", STRING, "RIHS01_1", QOS),
        SideEndpoint("/a/b", SERVICE, "/s", SET_BOOL),
        SideEndpoint("/a/b", CLIENT, "/c", SET_BOOL),
    }


async def test_nothing_is_read_while_nothing_changes(seen: Seen) -> None:
    """The graph is the same object; after a long time all is read once more."""
    seen.network.show("/a", (PUBLISHER, "/t", STRING))
    graph = seen.poll(3)
    reads = seen.network.reads
    assert seen.poll(10) is graph
    assert seen.network.reads == reads
    seen.network.endpoints.clear()
    seen.now += RESCAN_SEC
    assert seen.poll().endpoints == set()


async def test_a_storm_of_changes_is_read_a_few_times_per_second(seen: Seen) -> None:
    """Less often if there are many nodes; what has changed since the last reading is not forgotten."""
    seen.poll()
    seen.network.show("/a", (PUBLISHER, "/t", STRING))
    assert not seen.observer.poll(seen.now + READ_INTERVAL_SEC / 2).endpoints
    assert seen.names() == {("/a", "publisher", "/t")}
    for number in range(round(2 * READ_INTERVAL_SEC / READ_INTERVAL_PER_NODE_SEC)):
        seen.network.show(f"/n{number}")
    seen.poll()
    seen.network.show("/b", (PUBLISHER, "/t", STRING))
    assert len(seen.names()) == 1
    assert len(seen.names(2)) == 2


async def test_many_topics_are_read_in_shares(seen: Seen) -> None:
    """A poll reads at most so many, and the next ones the others."""
    topics = [(PUBLISHER, f"/t{number}", STRING) for number in range(INFOS_PER_POLL + 5)]
    seen.network.show("/a", *topics)
    assert len(seen.names()) == INFOS_PER_POLL
    assert len(seen.names()) == INFOS_PER_POLL + 5


async def test_a_publisher_that_is_made_again(seen: Seen) -> None:
    """The lists are the same, and its QoS is read within a few polls."""
    (shown,) = seen.network.show("/a", (PUBLISHER, "/t", STRING))
    seen.poll(3)
    seen.network.endpoints.remove(shown)
    (again,) = seen.network.show("/a", (PUBLISHER, "/t", STRING))
    again.qos = LATCHED
    (endpoint,) = seen.poll(3).endpoints
    assert endpoint.qos is not None
    assert endpoint.qos.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert seen.observer.offer_of("/t", shown.gid) is None
    assert seen.observer.offer_of("/t", again.gid) == endpoint.qos


async def test_a_node_that_goes_while_it_is_read(seen: Seen, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has no endpoints."""
    seen.network.show("/a", (SERVICE, "/s", SET_BOOL))
    node = seen.participant.control.rclpy_node
    names = node.get_node_names_and_namespaces_with_enclaves()
    seen.network.nodes.remove(("/a", "/"))
    monkeypatch.setattr(node, "get_node_names_and_namespaces_with_enclaves", lambda: names)
    assert seen.names() == set()


async def test_a_native_node_with_the_name_of_a_mirror(seen: Seen) -> None:
    """It has its own endpoints only; those of its services are found one by one."""
    mirror = seen.participant.mirror_node("/a")
    mirror.create_service(SERVICE_CLASS, "/mirror")
    seen.network.show("/a", (PUBLISHER, "/t", STRING), (SERVICE, "/s", SET_BOOL), (CLIENT, "/c", SET_BOOL))
    seen.network.nodes.append(("/a", "/"))
    own = {("/a", "publisher", "/t"), ("/a", "service", "/s"), ("/a", "client", "/c")}
    assert seen.names(4) == own
    mirror.destroy()
    assert seen.names(4) == own


async def test_the_services_of_a_node_stay_when_another_takes_its_name(seen: Seen) -> None:
    """As long as they have not been read one by one; then what has gone is gone."""
    (service,) = seen.network.show("/a", (SERVICE, "/s", SET_BOOL))
    seen.poll(3)
    seen.network.nodes.append(("/a", "/"))
    seen.network.has_changed = True
    assert seen.names() == {("/a", "service", "/s")}
    assert seen.names(3) == {("/a", "service", "/s")}
    seen.network.endpoints.remove(service)
    seen.network.has_changed = True
    assert seen.names(4) == set()


async def test_types_that_are_none_of_ros(seen: Seen) -> None:
    """Another program of DDS may have any on the topic of a service."""
    seen.network.show("/a")
    seen.network.nodes.append(("/a", "/"))
    (shown,) = seen.network.show("/a", (SERVICE, "/s", SET_BOOL))
    shown.type_hash = "INVALID"

    class Odd(Shown):
        topic_type = "Odd"

    seen.network.endpoints.append(Odd(SERVICE, "/odd", SET_BOOL, "/a", OTHER + bytes(4)))
    assert seen.names(4) == {("/a", "service", "/s")}
    assert seen.observer.request_hash("/s") == ""


async def test_the_mirrors_of_another_bridge(seen: Seen) -> None:
    """They are nodes of that bridge; endpoints with the names of native nodes are not taken for theirs."""
    enclave = "/callboard_bridge/two"
    seen.network.nodes += [("/callboard_bridge_two", enclave), ("/a", enclave), ("/a", "/")]
    events = (PUBLISHER, "/parameter_events", "rcl_interfaces/msg/ParameterEvent")
    seen.network.show("/callboard_bridge_two", events, prefix=BRIDGE)
    seen.network.nodes.remove(("/callboard_bridge_two", "/"))
    (mirror,) = seen.network.show("/a", (PUBLISHER, "/theirs", STRING), prefix=BRIDGE)
    (native,) = seen.network.show("/a", (PUBLISHER, "/t", STRING))
    graph = seen.poll(4)
    assert {each for each in graph.nodes if each.name == "/a"} == {SideNode("/a", "two"), SideNode("/a")}
    assert [each.name for each in graph.endpoints] == ["/t"]
    assert seen.observer.node_of("/theirs", mirror.gid) is None
    assert seen.observer.node_of("/t", native.gid) == "/a"


async def test_publishers_of_messages(seen: Seen) -> None:
    """One that is not known yet is looked up at once, but only once per poll, and own ones never."""
    seen.poll(3)
    (shown,) = seen.network.show("/a", (PUBLISHER, "/t", STRING))
    assert seen.observer.node_of("/t", shown.gid) == "/a"
    reads = seen.network.reads
    assert seen.observer.node_of("/t", OTHER + b"none") == ""
    assert seen.observer.node_of("/t", OTHER + b"none") == ""
    assert seen.network.reads == reads
    assert seen.observer.node_of("/other", OWN + bytes(4)) is None
    shown.node = "/_NODE_NAME_UNKNOWN_"
    seen.poll(3)
    assert seen.observer.node_of("/t", shown.gid) == ""


async def test_requests_have_hashes(seen: Seen) -> None:
    """Those of native servers; a bridge's do not count."""
    seen.participant.mirror_node("/mirror").create_service(SERVICE_CLASS, "/s")
    assert seen.observer.request_hash("/s") == ""
    seen.network.show("/a", (SERVICE, "/s", SET_BOOL))
    assert seen.observer.request_hash("/s") == "RIHS01_1"


async def test_a_participant_that_has_ended(seen: Seen) -> None:
    """The graph cannot be read any more."""
    seen.participant.close()
    with pytest.raises(RosError, match="ROS 2's graph cannot be read: it has been destroyed"):
        seen.poll()
