"""The graph as it is drawn, with the rates of its topics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.tools.graph_drawing.model import GraphFilter, model_of
from actors.web.live.panel import DocumentPanel

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.tools.graph_drawing.model import Vertex
    from actors.web.observer import Observer


class GraphPanel(DocumentPanel):
    """The graph: vertices and edges by their ids, and what does not match.

    Args:
        observer: Watches the graph.
        chosen: What to leave out.
        wake: See `DocumentPanel`.
    """

    def __init__(self, observer: Observer, chosen: GraphFilter, wake: Callable[[], None]) -> None:
        self._observer = observer
        self._chosen = chosen
        super().__init__(wake, observer.on_graph, observer.on_sample)

    def document(self) -> dict[str, Any]:
        """Return maps of `vertices`, `edges` and `mismatches`."""
        observer = self._observer
        model = model_of(observer.snapshot, self._chosen, observer.node_places())
        vertices: dict[str, Any] = {}
        for vertex in model.vertices:
            vertices[_id(vertex)] = {
                "kind": vertex.kind.value,
                "name": vertex.name,
                "broker": vertex.broker or None,
                "types": list(model.types.get(vertex, ())) or None,
            }
        edges: dict[str, Any] = {}
        for edge in model.edges:
            source, target = _id(edge.source), _id(edge.target)
            edges[f"{source} {edge.relation} {target}"] = {
                "source": source,
                "target": target,
                "relation": edge.relation.value,
                "names": list(edge.names) or None,
            }
        self._add_rates(vertices)
        return {
            "connected": observer.connected,
            "vertices": vertices,
            "edges": edges,
            "mismatches": {" ".join(each[:3]): each._asdict() for each in model.mismatches},
        }

    def _add_rates(self, vertices: dict[str, Any]) -> None:
        seen = self._observer.overview
        if seen is None:
            return
        for topic in seen.topics:
            vertex = vertices.get(f"topic {topic.name}")
            if vertex is not None:
                vertex["messages_per_sec"] = topic.messages_per_sec
                vertex["bytes_per_sec"] = topic.bytes_per_sec
                vertex["drops_per_sec"] = topic.drops_per_sec
        for node in seen.nodes:
            vertex = vertices.get(f"node {node.name}")
            if vertex is not None:
                vertex["state"] = node.state


def _id(vertex: Vertex) -> str:
    """Return the id of a vertex: a service may have the name of a topic."""
    return f"{vertex.kind.value} {vertex.name}"
