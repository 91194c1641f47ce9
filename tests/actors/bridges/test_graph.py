"""Callboard's graph as plans read it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bridges.graph import SideGraph, SideNode, our_graph, unseen
from actors.graph.snapshot import GraphSnapshot
from actors.qos.profile import QoSProfile
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from tests.actors.bridges.sides import CLIENT, PUBLISHER, SERVICE, SET_BOOL, STRING, endpoint

if TYPE_CHECKING:
    from proto.wire.frames import Scalar


def test_natives_with_their_endpoints_and_mirrors_without() -> None:
    """What a bridge shows is known by its labels, also where a native node shares its name."""
    origin: dict[str, Scalar] = {"label.origin": "ros2/7", "shared": True}
    graph = snapshot(
        GraphEntry(1, EntryKind.NODE, "/base", "", "", "", {"shared": True}),
        GraphEntry(2, EntryKind.NODE, "/base", "", "", "", origin),
        GraphEntry(3, PUBLISHER, "/base", "/pose", STRING, "RIHS01_1", {"depth": 3}),
        GraphEntry(4, PUBLISHER, "/base", "/map", STRING, "", {"node": 2}),
        GraphEntry(5, SERVICE, "/base", "/light", SET_BOOL, "", {}),
    )
    pose = endpoint("/base", PUBLISHER, "/pose", qos=QoSProfile.from_wire({"depth": 3}), type_hash="RIHS01_1")
    assert graph.nodes == {SideNode("/base"), SideNode("/base", "ros2/7")}
    assert graph.endpoints == {pose, endpoint("/base", SERVICE, "/light")}


def test_clients_of_the_bridge_itself_are_not_in_it() -> None:
    """`callboard bridge info` does not become a node of the other network."""
    graph = snapshot(
        GraphEntry(1, EntryKind.NODE, "/bridge_7", "", "", "", {"label.bridge": "ros2/7"}),
        GraphEntry(2, EntryKind.NODE, "/asks", "", "", "", {}),
        GraphEntry(3, CLIENT, "/asks", "/bridge_7/get_report", SET_BOOL, "", {}),
        GraphEntry(4, CLIENT, "/asks", "/bridge_71/get_report", SET_BOOL, "", {}),
    )
    assert {each.name for each in graph.endpoints} == {"/bridge_71/get_report"}


def snapshot(*entries: GraphEntry) -> SideGraph:
    """Return the graph with these entries, as plans read it."""
    return our_graph(GraphSnapshot(entries={entry.key: entry for entry in entries}))


def test_a_bridge_that_does_not_see_its_own_node_says_so() -> None:
    """A broker hides without a word what a user may not see; the refusal names the user and the remedy."""
    seen = SideGraph(frozenset({SideNode("/bridge_7", "ros2/7"), SideNode("/base")}))
    assert unseen(seen, "/bridge_7", "robot1") == ()
    for hidden in (SideGraph(), SideGraph(frozenset({SideNode("/base")}))):
        (refusal,) = unseen(hidden, "/bridge_7", "robot1")
        assert "'robot1'" in refusal.text
        assert 'allow.see = ["/**"]' in refusal.text
        assert not refusal.quiet
