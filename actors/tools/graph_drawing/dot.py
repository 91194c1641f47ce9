"""A drawing of the graph in DOT, Graphviz's language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.model import MISMATCH, MISMATCH_COLOR, Kind, Relation
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.model import Edge, GraphModel

_ATTRIBUTES: Final = {
    Kind.NODE: 'shape=box, style="rounded,filled", fillcolor="#eaf1fb", color="#3b6fb6"',
    Kind.TOPIC: 'shape=box, style=filled, fillcolor="#e8f6ef", color="#2e8b62"',
    Kind.SERVICE: 'shape=hexagon, style=filled, fillcolor="#fdf1e3", color="#c2701c"',
}
_DASHED: Final = {Relation.CALLS, Relation.SERVES}


def dot_of(model: GraphModel) -> str:
    """Return a model as a DOT document, without a final newline.

    Args:
        model: What to draw.
    """
    number = {vertex: f"{vertex.kind.value}{at}" for at, vertex in enumerate(model.vertices)}
    lines = [
        "digraph callboard {",
        "  rankdir=LR;",
        '  node [fontname="monospace", fontsize=11];',
        '  edge [fontname="monospace", fontsize=10, color="#667085"];',
    ]
    lines += [
        f"  {number[vertex]} [label={_quoted(vertex.label)}, {_ATTRIBUTES[vertex.kind]}];"
        for vertex in model.vertices
    ]
    for edge in model.edges:
        attributes = _edge_attributes(edge, apart=edge in model.apart)
        lines.append(f"  {number[edge.source]} -> {number[edge.target]}{attributes};")
    return "\n".join([*lines, "}"])


def _edge_attributes(edge: Edge, *, apart: bool) -> str:
    attributes: list[str] = []
    if apart:
        attributes += [
            f"label={_quoted(MISMATCH)}",
            f'color="{MISMATCH_COLOR}", fontcolor="{MISMATCH_COLOR}"',
        ]
    if edge.names:
        attributes.append(f"label={_quoted(', '.join(edge.names))}")
    if apart or edge.relation in _DASHED:
        attributes.append("style=dashed")
    return f" [{', '.join(attributes)}]" if attributes else ""


def _quoted(text: str) -> str:
    """Return a string as a quoted DOT string."""
    return '"' + escape(text).replace("\\", "\\\\").replace('"', '\\"') + '"'
