"""What of a graph is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.graph.snapshot import GraphSnapshot
from actors.tools.graph_drawing import model as model_module
from actors.tools.graph_drawing.mismatches import Mismatch, mismatches_of
from actors.tools.graph_drawing.model import (
    DrawingTooLargeError,
    Edge,
    GraphFilter,
    Kind,
    Relation,
    Vertex,
    document_of,
    model_of,
)
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.wire.frames import Options


def names(graph: GraphSnapshot, **chosen: Any) -> set[str]:
    """Return the names of what is drawn."""
    return {vertex.name for vertex in model_of(graph, GraphFilter(**chosen)).vertices}


def test_edges_go_the_way_data_goes(graph: Callable[[str], GraphSnapshot]) -> None:
    """From publishers and clients to topics and services, from there to subscriptions and servers."""
    found = model_of(graph("/a >/x ?/s\n/b </x !/s")).edges
    a, b = Vertex(Kind.NODE, "/a"), Vertex(Kind.NODE, "/b")
    topic, service = Vertex(Kind.TOPIC, "/x"), Vertex(Kind.SERVICE, "/s")
    assert set(found) == {
        Edge(a, topic, Relation.PUBLISHES),
        Edge(topic, b, Relation.SUBSCRIBES),
        Edge(a, service, Relation.CALLS),
        Edge(service, b, Relation.SERVES),
    }
    assert list(found) == sorted(found)


def test_a_service_and_a_node_may_have_one_name(graph: Callable[[str], GraphSnapshot]) -> None:
    """They are two vertices."""
    assert [vertex.kind for vertex in model_of(graph("/x !/x")).vertices] == [Kind.NODE, Kind.SERVICE]


def test_two_publishers_of_a_node_are_one_arrow(graph: Callable[[str], GraphSnapshot]) -> None:
    """A picture says who talks to whom, not how often they have said so."""
    assert len(model_of(graph("/a >/x >/x")).edges) == 1


@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        ({}, "/a /b /x /dead /s"),
        ({"dead_sinks": False}, "/a /b /x /s"),
        ({"leaf_topics": False}, "/a /b /x /s"),
        ({"services": False}, "/a /b /x /dead"),
        ({"hidden": True}, "/a /b /x /dead /s /_h /b/_t"),
        ({"debug": True}, "/a /b /x /dead /s /rosout /b/get_parameters /rqt_plot"),
        ({"nodes_only": True}, "/a /b"),
    ],
    ids=str,
)
def test_what_is_left_out(
    chosen: dict[str, bool], expected: str, graph: Callable[[str], GraphSnapshot]
) -> None:
    """Hidden names and what serves debugging, unless it is asked for; the rest only if asked for."""
    drawn = graph(
        "/a >/x >/dead >/rosout ?/s\n/b </x !/s !/b/get_parameters </b/_t\n/_h >/b/_t\n/rqt_plot </x"
    )
    assert names(drawn, **chosen) == set(expected.split())


def test_a_leaf_may_have_a_subscription_only(graph: Callable[[str], GraphSnapshot]) -> None:
    """A topic that nobody publishes on is no dead sink, but a leaf."""
    assert names(graph("/a </x"), dead_sinks=False) == {"/a", "/x"}
    assert names(graph("/a </x"), leaf_topics=False) == {"/a"}


def test_nodes_of_command_lines_serve_debugging(graph: Callable[[str], GraphSnapshot]) -> None:
    """They are left out although hidden names are asked for."""
    assert names(graph("/_callboard_cli_1 </x\n/a >/x"), hidden=True) == {"/a", "/x"}


def test_a_namespace_is_whole_tokens(graph: Callable[[str], GraphSnapshot]) -> None:
    """Topics outside it are drawn if a node inside has to do with them."""
    drawn = graph("/r1/a >/x\n/r1/deep/b >/y\n/r10/c </x\n/d </y >/z")
    assert names(drawn, namespace="/r1") == {"/r1/a", "/r1/deep/b", "/x", "/y"}


def test_nodes_only_names_topics_at_the_arrows(graph: Callable[[str], GraphSnapshot]) -> None:
    """One arrow for each pair and kind; a topic with one end makes none."""
    drawn = graph("/a >/x >/y ?/s >/dead\n/b </x </y !/s >/y")
    a, b = Vertex(Kind.NODE, "/a"), Vertex(Kind.NODE, "/b")
    assert model_of(drawn, GraphFilter(nodes_only=True)).edges == (
        Edge(a, b, Relation.CALLS, ("/s",)),
        Edge(a, b, Relation.PUBLISHES, ("/x", "/y")),
        Edge(b, b, Relation.PUBLISHES, ("/y",)),
    )


def test_too_many_arrows_are_refused(
    graph: Callable[[str], GraphSnapshot], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before they are made."""
    monkeypatch.setattr(model_module, "MAX_DIRECT_EDGES", 3)
    drawn = graph("/a >/x\n/b >/x\n/c </x\n/d </x")
    assert len(model_of(drawn).edges) == 4
    with pytest.raises(DrawingTooLargeError, match="more than 3 arrows"):
        model_of(drawn, GraphFilter(nodes_only=True))


def test_document(graph: Callable[[str], GraphSnapshot]) -> None:
    """Plain data with types; names at the arrows with nodes only."""
    drawn = graph("/a >/x\n/b </x !/s")
    assert document_of(model_of(drawn)) == {
        "nodes": [{"name": "/a"}, {"name": "/b"}],
        "topics": [
            {"name": "/x", "types": ["example_msgs/msg/Message"]},
        ],
        "services": [{"name": "/s", "types": ["example_msgs/srv/Call"]}],
        "edges": [
            {"source": "/a", "target": "/x", "relation": "publishes"},
            {"source": "/s", "target": "/b", "relation": "serves"},
            {"source": "/x", "target": "/b", "relation": "subscribes"},
        ],
        "mismatches": [],
    }
    assert document_of(model_of(drawn, GraphFilter(nodes_only=True)))["edges"] == [
        {"source": "/a", "target": "/b", "relation": "publishes", "names": ["/x"]},
    ]


@pytest.mark.parametrize("chosen", [GraphFilter(), GraphFilter(nodes_only=True)])
def test_strict_endpoints_that_do_not_match_are_no_connection(chosen: GraphFilter) -> None:
    """They are listed and have no direct arrow, unless other endpoints of the two nodes match."""
    best_effort: Options = {"reliability": 2}
    strict: Options = {"strict": True}
    ends: list[tuple[EntryKind, str, Options]] = [
        (EntryKind.PUBLISHER, "/a", best_effort),
        (EntryKind.PUBLISHER, "/b", {}),
        (EntryKind.SUBSCRIPTION, "/lenient", {}),
        (EntryKind.SUBSCRIPTION, "/strict", strict),
        (EntryKind.SUBSCRIPTION, "/both", strict),
        (EntryKind.SUBSCRIPTION, "/both", best_effort),
    ]
    nodes = [GraphEntry(at, EntryKind.NODE, f"/{name}", "", "", "", {}) for at, name in
             enumerate(("a", "b", "lenient", "strict", "both"))]  # fmt: skip
    endpoints = [
        GraphEntry(at, kind, node, "/x", "std_msgs/msg/String", "RIHS01_0", qos)
        for at, (kind, node, qos) in enumerate(ends, 9)
    ]
    model = model_of(GraphSnapshot(entries={each.key: each for each in (*nodes, *endpoints)}), chosen)
    assert model.mismatches == (Mismatch("/x", "/a", "/strict", "RELIABILITY"),)
    assert document_of(model)["mismatches"][0]["subscriber"] == "/strict"
    if chosen.nodes_only:
        arrows = {(edge.source.name, edge.target.name) for edge in model.edges}
        assert arrows == {(one, two) for one in ("/a", "/b") for two in ("/lenient", "/strict", "/both")} - {
            ("/a", "/strict")
        }


DIFFERENT_TYPES = (
    Mismatch("/s", "/cli", "/srv", "", ("std_srvs/srv/Empty", "example_msgs/srv/Call"), "service"),
    Mismatch("/x", "/a", "/b", "", ("example_msgs/msg/Message", "std_msgs/msg/Int32")),
)


@pytest.mark.parametrize("nodes_only", [False, True])
def test_endpoints_of_different_types_are_no_connection(
    nodes_only: bool, graph: Callable[[str], GraphSnapshot]
) -> None:
    """Of topics and services: they are listed, their edges are marked, and no direct arrow joins them."""
    model = model_of(graph("mismatches"), GraphFilter(nodes_only=nodes_only))
    assert model.mismatches == DIFFERENT_TYPES
    if nodes_only:
        assert [(edge.source.name, edge.target.name) for edge in model.edges] == [("/a", "/c")]
        return
    edges = document_of(model)["edges"]
    assert [(each["source"], each["target"]) for each in edges if each.get("mismatch")] == [
        ("/a", "/x"),
        ("/cli", "/s"),
        ("/s", "/srv"),
        ("/x", "/b"),
    ]


def test_definitions_that_differ_are_no_connection() -> None:
    """The name of the type is the same, its hash is not; a raw subscription takes both."""
    ends = [
        (EntryKind.PUBLISHER, "/a", "RIHS01_0"),
        (EntryKind.PUBLISHER, "/b", "RIHS01_1"),
        (EntryKind.SUBSCRIPTION, "/c", "RIHS01_1"),
        (EntryKind.SUBSCRIPTION, "/raw", ""),
    ]
    entries = [
        GraphEntry(at, kind, node, "/x", "std_msgs/msg/String" if of_type else "", of_type, {})
        for at, (kind, node, of_type) in enumerate(ends)
    ]
    (found,) = mismatches_of(entries)
    assert found == Mismatch("/x", "/a", "/c", "", ("std_msgs/msg/String", "std_msgs/msg/String"))
    assert found.text == (
        "Not connected, as their definitions of the type differ: /a publishes /x and /c subscribes to it as"
        " std_msgs/msg/String"
    )


def test_a_mismatch_is_a_sentence_and_plain_data() -> None:
    """The keys name its kind and its ends."""
    service, topic = DIFFERENT_TYPES
    assert service.document() == {
        "service": "/s",
        "client": "/cli",
        "server": "/srv",
        "policy": None,
        "types": ["std_srvs/srv/Empty", "example_msgs/srv/Call"],
        "text": "Not connected, as their types differ: /cli calls /s as std_srvs/srv/Empty, /srv serves it as"
        " example_msgs/srv/Call",
    }
    assert topic.document()["text"] == (
        "Not connected, as their types differ: /a publishes /x as example_msgs/msg/Message, /b subscribes to"
        " it as std_msgs/msg/Int32"
    )
    assert Mismatch("/x", "/a", "/b", "DURABILITY").text == (
        "Not connected, as one of them is strict: /a publishes /x with a QoS that /b does not match:"
        " DURABILITY"
    )
