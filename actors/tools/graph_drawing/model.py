"""The content of a drawing of the graph: nodes, topics, services, and the edges between them.

An edge has the direction of the data: from a publisher's node to the topic and on to a subscription's node;
from a client's node to the service and on to the server's node.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.graph.snapshot import labels_text
from actors.tools.graph_drawing.mismatches import Mismatch, mismatches_of
from proto.errors import CallboardError
from proto.wire.codes import EntryKind
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.graph.snapshot import GraphSnapshot
    from proto.wire.frames import GraphEntry


MAX_DIRECT_EDGES: Final = 50_000
"""Arrows from node to node: a topic with 1,000 publishers and 1,000 subscriptions would make a million."""

MISMATCH: Final = "does not match"
"""The label of an edge to a node that a topic or service does not connect."""
MISMATCH_COLOR: Final = "#c0392b"


class DrawingTooLargeError(CallboardError):
    """A graph is too large for a drawing. Choose a namespace, or another format."""


class Kind(StrEnum):
    """The kind of a vertex."""

    NODE = "node"
    TOPIC = "topic"
    SERVICE = "service"


class Relation(StrEnum):
    """The relation of a node to a topic or a service."""

    PUBLISHES = "publishes"
    SUBSCRIBES = "subscribes"
    CALLS = "calls"
    SERVES = "serves"


class Vertex(NamedTuple):
    """A node, a topic or a service; a service may have the name of a node.

    Attributes:
        kind: Which of them it is.
        name: Its full name.
        broker: The name of a node's broker, or of several; empty if no mesh has several.
        labels: The names and texts of a node's labels.
    """

    kind: Kind
    name: str
    broker: str = ""
    labels: tuple[tuple[str, str], ...] = ()

    @property
    def label(self) -> str:
        """Its name, with a node's broker and labels."""
        more = ", ".join(filter(None, (self.broker, labels_text(dict(self.labels)))))
        return f"{self.name} ({more})" if more else self.name


class Edge(NamedTuple):
    """An arrow.

    Attributes:
        source: Where it begins.
        target: Where it ends.
        relation: The action of the node; between two nodes (`nodes_only`), of the source.
        names: Between two nodes, the topics on which the source publishes to the target, or the services of
            the target that it calls; else empty.
    """

    source: Vertex
    target: Vertex
    relation: Relation
    names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class GraphFilter:
    """The parts of a graph to leave out, as in rqt_graph.

    Attributes:
        hidden: Show names with a token that begins with an underscore.
        debug: Show debugging endpoints: /rosout, /clock, /parameter_events, /statistics, nodes of command
            lines, rqt and rviz, services about parameters.
        dead_sinks: Show topics without a subscription.
        leaf_topics: Show topics with a single publisher or subscription.
        services: Show services.
        namespace: Show only the nodes in this namespace, with their topics and services. Empty: all.
        nodes_only: Show only nodes; the names of topics and services label the arrows between them.
    """

    hidden: bool = False
    debug: bool = False
    dead_sinks: bool = True
    leaf_topics: bool = True
    services: bool = True
    namespace: str = ""
    nodes_only: bool = False


@dataclass(frozen=True, slots=True)
class GraphModel:
    """The content of a drawing: sorted, and each vertex and edge once.

    Attributes:
        vertices: The nodes, topics and services.
        edges: Arrows between these vertices; each topic and service has one at least.
        types: The declared types of each topic and service, sorted.
        mismatches: Nodes that have a topic or service in common but are not connected by it, as their types
            differ or their QoS is strict.
        apart: The edges that lead to the nodes of a mismatch.
    """

    vertices: tuple[Vertex, ...] = ()
    edges: tuple[Edge, ...] = ()
    types: dict[Vertex, tuple[str, ...]] = field(default_factory=dict[Vertex, tuple[str, ...]])
    mismatches: tuple[Mismatch, ...] = ()
    apart: frozenset[Edge] = frozenset()

    def of_kind(self, kind: Kind) -> list[Vertex]:
        """Return the vertices of a kind.

        Args:
            kind: Nodes, topics or services.
        """
        return [vertex for vertex in self.vertices if vertex.kind is kind]


_DEBUG_TOPICS: Final = {"/rosout", "/clock", "/parameter_events", "/statistics"}
_DEBUG_NODES: Final = ("rqt", "rviz", "_callboard_cli", "_ros2cli")
_DEBUG_SERVICES: Final = {
    "describe_parameters",
    "get_diagnostics",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
}
_RELATIONS: Final = {
    EntryKind.PUBLISHER: Relation.PUBLISHES,
    EntryKind.SUBSCRIPTION: Relation.SUBSCRIBES,
    EntryKind.CLIENT: Relation.CALLS,
    EntryKind.SERVICE: Relation.SERVES,
}
_OF_TOPICS: Final = {Relation.PUBLISHES, Relation.SUBSCRIBES}
_OUTWARD: Final = {Relation.PUBLISHES, Relation.CALLS}


def model_of(
    snapshot: GraphSnapshot, chosen: GraphFilter | None = None, brokers: Mapping[str, str] | None = None
) -> GraphModel:
    """Return the part of a graph that is to be drawn.

    Args:
        snapshot: The graph.
        chosen: The parts to leave out; None for the defaults. A topic or service is left out with all its
            nodes.
        brokers: The names of the brokers of a mesh, by the full names of their nodes.

    Raises:
        DrawingTooLargeError: There are more than `MAX_DIRECT_EDGES` arrows from node to node.
    """
    chosen, brokers, labels = chosen or GraphFilter(), brokers or {}, snapshot.node_labels()
    nodes = {
        name: Vertex(Kind.NODE, name, brokers.get(name, ""), tuple(labels.get(name, {}).items()))
        for name in snapshot.nodes()
        if _shows_node(name, chosen)
    }
    shown = [entry for entry in snapshot.entries.values() if entry.node in nodes and _shows(entry, chosen)]
    links = {_edge(entry, nodes) for entry in shown if entry.kind in _RELATIONS}
    links -= _unwanted(links, chosen)
    types: dict[Vertex, set[str]] = {}
    hubs = {_hub(edge) for edge in links}
    for entry in shown:
        if entry.kind in _RELATIONS and (hub := _hub(_edge(entry, nodes))) in hubs:
            types.setdefault(hub, set()).update({entry.type_name} - {""})
    vertices = {*nodes.values()}
    ends = (entry for entry in shown if entry.kind in _RELATIONS and _hub(_edge(entry, nodes)) in hubs)
    mismatches = tuple(mismatches_of(ends))
    if chosen.nodes_only:
        return GraphModel(
            tuple(sorted(vertices)), tuple(sorted(_direct(links, mismatches))), mismatches=mismatches
        )
    return GraphModel(
        tuple(sorted(vertices | hubs)),
        tuple(sorted(links)),
        {hub: tuple(sorted(names)) for hub, names in sorted(types.items())},
        mismatches,
        frozenset(links & _apart(mismatches, nodes)),
    )


def _apart(mismatches: Iterable[Mismatch], nodes: Mapping[str, Vertex]) -> set[Edge]:
    """Return the edges between a topic or service and the nodes that it does not connect."""
    found: set[Edge] = set()
    for each in mismatches:
        source, target = nodes[each.source], nodes[each.target]
        hub = Vertex(Kind(each.kind), each.name)
        is_topic = hub.kind is Kind.TOPIC
        found.add(Edge(source, hub, Relation.PUBLISHES if is_topic else Relation.CALLS))
        found.add(Edge(hub, target, Relation.SUBSCRIBES if is_topic else Relation.SERVES))
    return found


def _shows_node(name: str, chosen: GraphFilter) -> bool:
    if not chosen.debug and name.rpartition("/")[2].startswith(_DEBUG_NODES):
        return False
    space = chosen.namespace.rstrip("/") + "/"
    return (chosen.hidden or not is_hidden(name)) and (not chosen.namespace or name.startswith(space))


def _shows(entry: GraphEntry, chosen: GraphFilter) -> bool:
    """Return whether an endpoint is shown, as far as that depends on it alone."""
    if not chosen.hidden and is_hidden(entry.name):
        return False
    if entry.kind in {EntryKind.SERVICE, EntryKind.CLIENT}:
        return chosen.services and (chosen.debug or entry.name.rpartition("/")[2] not in _DEBUG_SERVICES)
    return chosen.debug or entry.name not in _DEBUG_TOPICS


def _edge(entry: GraphEntry, nodes: Mapping[str, Vertex]) -> Edge:
    relation = _RELATIONS[EntryKind(entry.kind)]
    node = nodes[entry.node]
    hub = Vertex(Kind.TOPIC if relation in _OF_TOPICS else Kind.SERVICE, entry.name)
    return Edge(node, hub, relation) if relation in _OUTWARD else Edge(hub, node, relation)


def _hub(edge: Edge) -> Vertex:
    """Return the topic or service of an edge."""
    return edge.target if edge.relation in _OUTWARD else edge.source


def _unwanted(links: Iterable[Edge], chosen: GraphFilter) -> set[Edge]:
    """Return the edges of topics that are dead sinks or leaves and are not wanted."""
    readers: dict[Vertex, int] = {}
    ends: dict[Vertex, int] = {}
    for edge in links:
        hub = _hub(edge)
        ends[hub] = ends.get(hub, 0) + 1
        readers[hub] = readers.get(hub, 0) + (edge.relation is Relation.SUBSCRIBES)
    return {
        edge
        for edge in links
        if (hub := _hub(edge)).kind is Kind.TOPIC
        and ((not chosen.dead_sinks and not readers[hub]) or (not chosen.leaf_topics and ends[hub] == 1))
    }


def _direct(links: Iterable[Edge], mismatches: Iterable[Mismatch]) -> list[Edge]:
    """Return the edges from node to node that edges over topics and services make, without mismatches.

    Raises:
        DrawingTooLargeError: There are more than `MAX_DIRECT_EDGES`.
    """
    into: dict[Vertex, set[Vertex]] = {}
    out_of: dict[Vertex, set[Vertex]] = {}
    for edge in links:
        if edge.relation in _OUTWARD:
            into.setdefault(edge.target, set()).add(edge.source)
        else:
            out_of.setdefault(edge.source, set()).add(edge.target)
    if sum(len(sources) * len(out_of.get(hub, ())) for hub, sources in into.items()) > MAX_DIRECT_EDGES:
        raise DrawingTooLargeError(f"more than {MAX_DIRECT_EDGES} arrows from node to node are too many")
    apart = {(each.kind, each.name, each.source, each.target) for each in mismatches}
    names: dict[tuple[Vertex, Vertex, Relation], list[str]] = {}
    for hub, sources in into.items():
        relation = Relation.PUBLISHES if hub.kind is Kind.TOPIC else Relation.CALLS
        for source in sources:
            for target in out_of.get(hub, ()):
                if (hub.kind, hub.name, source.name, target.name) in apart:
                    continue
                names.setdefault((source, target, relation), []).append(hub.name)
    return [Edge(*ends, tuple(sorted(found))) for ends, found in names.items()]


def document_of(model: GraphModel) -> dict[str, list[dict[str, Any]]]:
    """Return a model as plain data, for JSON; docs/reference/json.md describes it.

    Args:
        model: What to write.
    """
    return {
        "nodes": [
            {
                "name": vertex.name,
                **({"broker": vertex.broker} if vertex.broker else {}),
                **({"labels": dict(vertex.labels)} if vertex.labels else {}),
            }
            for vertex in model.of_kind(Kind.NODE)
        ],
        "topics": _documents(model, Kind.TOPIC),
        "services": _documents(model, Kind.SERVICE),
        "edges": [
            {
                "source": edge.source.name,
                "target": edge.target.name,
                "relation": edge.relation.value,
                **({"names": list(edge.names)} if edge.names else {}),
                **({"mismatch": True} if edge in model.apart else {}),
            }
            for edge in model.edges
        ],
        "mismatches": [each.document() for each in model.mismatches],
    }


def _documents(model: GraphModel, kind: Kind) -> list[dict[str, object]]:
    return [
        {"name": vertex.name, "types": list(model.types.get(vertex, ()))} for vertex in model.of_kind(kind)
    ]
