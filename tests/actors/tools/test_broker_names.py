"""The brokers of a mesh in what commands show of the graph."""

from __future__ import annotations

import pytest

from actors.cli.commands.top.columns import NODES, chosen
from actors.graph.broker_report import BrokerReport
from actors.graph.snapshot import GraphSnapshot
from actors.tools import broker_checks, graph_documents
from actors.tools.broker_names import BrokerNames
from actors.tools.graph_drawing.dot import dot_of
from actors.tools.graph_drawing.mermaid import mermaid_of
from actors.tools.graph_drawing.model import GraphModel, document_of, model_of
from actors.tools.graph_drawing.svg import svg_of
from actors.tools.graph_drawing.text import text_of
from actors.tools.overview import Sample, Samples
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from proto.wire.stats import BrokerStats, MeshBrokerStats


def graph(*nodes: tuple[int, str], shared: bool = False) -> GraphSnapshot:
    """Return a graph of nodes, each given by its broker and name."""
    qos = {"shared": True} if shared else {}
    entries = [
        GraphEntry(broker << 32 | number, EntryKind.NODE, name, "", "", "", qos)
        for number, (broker, name) in enumerate(nodes, 1)
    ]
    return GraphSnapshot(entries={entry.key: entry for entry in entries})


def report(*names: str) -> BrokerReport:
    """Return the report of the first of some brokers, which have the numbers from 1."""
    brokers = {number: MeshBrokerStats(number, name, "1") for number, name in enumerate(names, 1)}
    return BrokerReport(totals=BrokerStats(), topics={}, links={}, brokers=brokers)


def test_ambiguous_and_missing_names_have_the_id() -> None:
    """So that each broker can be told from the others."""
    names = BrokerNames(report("a", "b", "b", ""))
    assert [names[number] for number in (1, 2, 3, 4, 0x123)] == [
        *("a", "b (00000002)", "b (00000003)", "00000004", "00000123")
    ]
    assert names.joined([2, 1, 1]) == "a, b (00000002)"
    assert [BrokerNames(report(*each)).several for each in ("", "a", "ab")] == [False, False, True]


def test_only_names_that_are_not_shared_are_duplicates() -> None:
    """One node that does not share it is enough. They are listed by the names of their brokers."""
    two = ((2, "/same"), (1, "/same"), (1, "/other"))
    assert graph(*two).duplicate_nodes() == {"/same": [1, 2]}
    assert graph(*two, shared=True).duplicate_nodes() == {}
    assert graph_documents.nodes(graph(*two), BrokerNames(report("beta", "alpha"))) == [
        {"name": "/other", "broker": "beta", "duplicate": False},
        {"name": "/same", "broker": "alpha", "duplicate": True},
        {"name": "/same", "broker": "beta", "duplicate": True},
    ]
    assert graph(*two).node_brokers() == {"/other": [1], "/same": [1, 2]}


@pytest.mark.parametrize(
    ("names", "findings"),
    [
        ((), []),
        (("a",), [("warn", "the broker has joined a mesh and sees no other broker")]),
        (("a", "b"), [("ok", "2 brokers: a, b"), ("warn", "2 nodes are /same, on a, b")]),
    ],
)
def test_the_doctor_looks_at_the_mesh(names: tuple[str, ...], findings: list[tuple[str, str]]) -> None:
    """At nothing without one; warnings say what to do."""
    checks = broker_checks.mesh(report(*names), graph((1, "/same"), (2, "/same")))
    assert [(each.status, each.finding) for each in checks] == findings
    assert all(each.remedy for each in checks if each.status == "warn")


def test_the_overview_names_the_brokers_of_nodes() -> None:
    """If there are several; the filter finds them."""
    snapshot = graph((1, "/here"), (2, "/there"))
    rows = Samples().add(Sample(snapshot, report("a", "b"))).nodes
    assert [(row.name, row.broker) for row in rows] == [("/here", "a"), ("/there", "b")]
    assert [row.name for row in chosen(rows, NODES[0], "b", falling=False)] == ["/there"]
    alone = Samples().add(Sample(snapshot, report("a"))).nodes
    assert [row.broker for row in alone] == ["", ""]


def test_drawings_name_the_brokers_of_nodes() -> None:
    """In each format, next to the node's name."""
    model = model_of(graph((1, "/here")), brokers={"/here": "a"})
    assert document_of(model)["nodes"] == [{"name": "/here", "broker": "a"}]
    for draw in (dot_of, mermaid_of, svg_of, _text_of):
        assert "/here (a)" in draw(model).replace("#40;", "(").replace("#41;", ")")  # Mermaid's
    assert document_of(model_of(graph((1, "/here"))))["nodes"] == [{"name": "/here"}]


def _text_of(model: GraphModel) -> str:
    return text_of(model, width=80)


def test_a_report_as_plain_data_has_the_mesh() -> None:
    """Brokers by number, and the counts."""
    document = report("a").as_dict()
    assert document["brokers"][1]["name"] == "a"
    assert document["mesh"]["resets"] == 0
