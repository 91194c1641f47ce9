"""What the graph at one moment says of endpoints and actions."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actors.graph.snapshot import EndpointInfo, GraphSnapshot, actions_among
from actors.qos.profile import QoSProfile, qos_profile_unknown
from proto.wire import frames
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry

EMPTY = EndpointInfo(
    node_name="",
    node_namespace="",
    topic_type="",
    topic_type_hash="",
    endpoint_type=EntryKind.NODE,
    endpoint_id=0,
    qos_profile=qos_profile_unknown,
)


def test_an_empty_endpoint_is_fourteen_lines() -> None:
    """Rclpy's labels; what is not known is INVALID or UNKNOWN, and no time is Infinite."""
    assert str(EMPTY).splitlines() == [
        "Node name: ",
        "Node namespace: ",
        "Topic type: ",
        "Topic type hash: INVALID",
        "Endpoint type: INVALID",
        "GID: 0",
        "QoS profile:",
        "  Reliability: UNKNOWN",
        "  History (Depth): UNKNOWN",
        "  Durability: UNKNOWN",
        "  Lifespan: Infinite",
        "  Deadline: Infinite",
        "  Liveliness: UNKNOWN",
        "  Liveliness lease duration: Infinite",
    ]


def test_limits_and_depth_are_shown() -> None:
    """A depth with KEEP_LAST, and times in nanoseconds."""
    lines = str(replace(EMPTY, qos_profile=QoSProfile(depth=3, lifespan=1.5))).splitlines()
    assert "  History (Depth): KEEP_LAST (3)" in lines
    assert "  Lifespan: 1500000000 nanoseconds" in lines


@pytest.mark.parametrize(("kind", "name"), [(EntryKind.SERVICE, "SERVER"), (EntryKind.CLIENT, "CLIENT")])
def test_endpoints_of_services_say_so(kind: EntryKind, name: str) -> None:
    """Service stands where topics have Topic."""
    lines = str(replace(EMPTY, endpoint_type=kind)).splitlines()
    assert lines[2:5] == ["Service type: ", "Service type hash: INVALID", f"Endpoint type: {name}"]


def test_actions_are_known_by_their_services() -> None:
    """The service that takes goals gives an action its name and type."""
    services = [
        ("/a/fib/_action/get_result", ["x/action/Fib_GetResult"]),
        ("/a/fib/_action/send_goal", ["x/action/Fib_SendGoal"]),
        ("/b", ["x/srv/B"]),
    ]
    assert actions_among(services) == [("/a/fib", ["x/action/Fib"])]


def test_the_endpoints_of_a_node() -> None:
    """With their names, in the order of their declaration; without the node itself and those of others."""
    entries = [
        GraphEntry(3, EntryKind.SERVICE, "/a", "/add", "example_interfaces/srv/AddTwoInts", "", {}),
        GraphEntry(2, EntryKind.PUBLISHER, "/a", "/chatter", "std_msgs/msg/String", "", {}),
        GraphEntry(1, EntryKind.NODE, "/a", "", "", "", {}),
        GraphEntry(4, EntryKind.PUBLISHER, "/b", "/chatter", "std_msgs/msg/String", "", {}),
    ]
    found = GraphSnapshot({each.key: each for each in entries}).node_endpoints("/a")
    assert [(name, info.endpoint_type, info.topic_type) for name, info in found] == [
        ("/chatter", EntryKind.PUBLISHER, "std_msgs/msg/String"),
        ("/add", EntryKind.SERVICE, "example_interfaces/srv/AddTwoInts"),
    ]


def labelled(key: int, node: str, **labels: str) -> GraphEntry:
    """Return the entry of a node."""
    return GraphEntry(
        key, EntryKind.NODE, node, "", "", "", {f"label.{name}": labels[name] for name in labels}
    )


def test_the_labels_of_nodes_that_share_a_name_are_told_together() -> None:
    """And apart for each endpoint, which names the entry of its node; nodes without labels are left out."""
    snapshot = GraphSnapshot()
    publishers = [
        GraphEntry(10 + key, EntryKind.PUBLISHER, "/a", "/t", "T", "H", {"node": key} if key else {})
        for key in range(3)
    ]
    nodes = [labelled(1, "/a", x="2"), labelled(2, "/a", x="1", y=""), labelled(3, "/a"), labelled(4, "/b")]
    snapshot.apply(frames.Graph(1, more=False, added=(*publishers, *nodes), removed=(), suspended=()))
    assert snapshot.node_labels() == {"/a": {"x": "1, 2", "y": ""}}
    assert [info.node_labels for _, info in snapshot.all_endpoints()] == [{}, {"x": "2"}, {"x": "1", "y": ""}]
    assert snapshot.labels_of(nodes[1]) == {"x": "1", "y": ""}


def test_labels_cannot_forge_lines() -> None:
    """Whatever a broker has let pass."""
    snapshot = GraphSnapshot()
    entry = GraphEntry(1, EntryKind.NODE, "/a", "", "", "", {"label.x\n": "1\n/b", "shared": True})
    snapshot.apply(frames.Graph(1, more=False, added=(entry,), removed=(), suspended=()))
    assert snapshot.node_labels() == {"/a": {r"x\n": r"1\n/b"}}
    assert snapshot.entries[1].qos["shared"] is True


def test_an_endpoint_tells_the_labels_of_its_node() -> None:
    """In one line more, below the namespace."""
    lines = str(replace(EMPTY, node_labels={"origin": "ros2/7", "a": "b"})).splitlines()
    assert (len(lines), lines[2]) == (15, "Node labels: origin=ros2/7, a=b")
