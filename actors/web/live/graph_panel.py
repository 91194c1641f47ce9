"""The graph as it is drawn, with the rates of its topics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.graph.snapshot import GraphSnapshot, actions_among
from actors.tools.graph_drawing.mismatches import mismatches_of
from actors.tools.graph_drawing.model import GraphFilter, model_of
from actors.tools.overview import SUSPENDED
from actors.web.live.panel import DocumentPanel
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.tools.graph_drawing.mismatches import Mismatch
    from actors.tools.graph_drawing.model import Vertex
    from actors.web.observer import Observer

MAX_VERTICES: Final = 5000
"""Nodes, topics and services that a page is sent; a browser draws no more."""


class GraphParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The parameters of the graph: what is drawn besides nodes and topics.

    Attributes:
        hidden: Also names with a token that begins with `_`.
        debug: Also endpoints for debugging; see `GraphFilter`.
        services: Also services.
        actions: Also actions.
    """

    hidden: bool = False
    debug: bool = False
    services: bool = False
    actions: bool = False


class GraphPanel(DocumentPanel):
    """The graph: vertices and edges by their ids, and what does not match.

    Args:
        observer: Watches the graph.
        chosen: The parts of the graph to draw.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, chosen: GraphParameters, wake: Callable[[], None]) -> None:
        self._observer = observer
        self._chosen = chosen
        super().__init__(wake, observer.on_graph, observer.on_sample)

    def document(self) -> dict[str, Any]:
        """Return `connected`, `omitted` (vertices), and maps of `vertices`, `edges` and `mismatches`."""
        observer, chosen = self._observer, self._chosen
        snapshot = observer.snapshot
        whole = GraphSnapshot({**snapshot.suspended, **snapshot.entries})
        wanted = GraphFilter(hidden=chosen.hidden, debug=chosen.debug, services=chosen.services)
        model = model_of(whole, wanted, observer.brokers_of_nodes())
        vertices = {
            _id(vertex): {
                "kind": vertex.kind.value,
                "name": vertex.name,
                "broker": vertex.broker or None,
                "labels": dict(vertex.labels) or None,
                "types": list(model.types.get(vertex, ())) or None,
            }
            for vertex in model.vertices
        }
        edges = {
            f"{_id(edge.source)} {edge.relation} {_id(edge.target)}": {
                "source": _id(edge.source),
                "target": _id(edge.target),
                "relation": edge.relation.value,
            }
            for edge in model.edges
        }
        apart = list(model.mismatches)
        if chosen.actions:
            _add_actions(whole, vertices, edges)
            apart += _mismatches_of_actions(whole, vertices)
        self._add_states(vertices, (entry.node for entry in snapshot.suspended.values()))
        vertices, edges, omitted = _limit(vertices, edges)
        return {
            "connected": observer.connected,
            "omitted": omitted or None,
            "vertices": vertices,
            "edges": edges,
            "mismatches": dict(_marked(each, edges) for each in apart),
        }

    def _add_states(self, vertices: dict[str, Any], suspended: Iterable[str]) -> None:
        """Add the rates of topics, as of the last sample, and which nodes are suspended."""
        overview = self._observer.overview
        for topic in () if overview is None else overview.topics:
            vertex = vertices.get(f"topic {topic.name}")
            if vertex is not None:
                vertex["messages_per_sec"] = topic.messages_per_sec
                vertex["bytes_per_sec"] = topic.bytes_per_sec
                vertex["drops_per_sec"] = topic.drops_per_sec
                vertex["dropped"] = topic.dropped
        for node in suspended:
            if f"node {node}" in vertices:
                vertices[f"node {node}"]["state"] = SUSPENDED


def _mismatches_of_actions(snapshot: GraphSnapshot, vertices: dict[str, Any]) -> list[Mismatch]:
    """Return the mismatches of the actions that are drawn: those of the services that accept their goals."""
    found: list[Mismatch] = []
    for each in mismatches_of(snapshot.of_kind(EntryKind.CLIENT, EntryKind.SERVICE)):
        for name, types in actions_among([(each.name, list(each.types))]):
            if f"action {name}" in vertices:
                found.append(each._replace(name=name, types=tuple(types), kind="action"))
    return found


def _marked(mismatch: Mismatch, edges: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Mark the edges of a mismatch; return an id, and its document with the ids of its vertices."""
    out, back = ("publishes", "subscribes") if mismatch.kind == "topic" else ("calls", "serves")
    source, target, hub = (
        f"node {mismatch.source}",
        f"node {mismatch.target}",
        f"{mismatch.kind} {mismatch.name}",
    )
    for edge in (f"{source} {out} {hub}", f"{hub} {back} {target}"):
        if edge in edges:
            edges[edge]["mismatch"] = True
    vertices = [source, hub, target]
    return " ".join(vertices), {**mismatch.document(), "vertices": vertices}


def _limit(vertices: dict[str, Any], edges: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any], int]:
    """Return `MAX_VERTICES` vertices with the edges between them, and how many vertices are left out."""
    omitted = max(0, len(vertices) - MAX_VERTICES)
    if omitted:
        vertices = dict(list(vertices.items())[:MAX_VERTICES])
        edges = {
            key: each for key, each in edges.items() if {each["source"], each["target"]} <= vertices.keys()
        }
    return vertices, edges, omitted


def _add_actions(snapshot: GraphSnapshot, vertices: dict[str, Any], edges: dict[str, Any]) -> None:
    """Add actions, and edges from their clients and to their servers."""
    for kind, relation in ((EntryKind.CLIENT, "calls"), (EntryKind.SERVICE, "serves")):
        for entry in snapshot.of_kind(kind):
            node = f"node {entry.node}"
            for name, types in actions_among([(entry.name, [entry.type_name])]):
                if node not in vertices:
                    continue
                action = f"action {name}"
                vertices.setdefault(action, {"kind": "action", "name": name, "types": types})
                source, target = (node, action) if relation == "calls" else (action, node)
                edges[f"{source} {relation} {target}"] = {
                    "source": source,
                    "target": target,
                    "relation": relation,
                }


def _id(vertex: Vertex) -> str:
    """Return the id of a vertex: a service may have the name of a topic."""
    return f"{vertex.kind.value} {vertex.name}"
