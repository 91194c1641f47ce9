"""A drawing of the graph in Mermaid, which Markdown viewers draw: paste it between ```mermaid and ```."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.model import MISMATCH, MISMATCH_COLOR, Kind, Relation
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.model import Edge, GraphModel

_SHAPES: Final = {Kind.NODE: ("([", "])"), Kind.TOPIC: ("[", "]"), Kind.SERVICE: ("{{", "}}")}
_CLASSES: Final = (
    "  classDef nodes fill:#eaf1fb,stroke:#3b6fb6,color:#1b2a41",
    "  classDef topics fill:#e8f6ef,stroke:#2e8b62,color:#14352a",
    "  classDef services fill:#fdf1e3,stroke:#c2701c,color:#4a2a08",
)
_DASHED: Final = {Relation.CALLS, Relation.SERVES}
_SPECIAL: Final = re.compile(r"[^\w /,.-]")


def mermaid_of(model: GraphModel) -> str:
    """Return a model as a Mermaid flow chart, without a final newline.

    Args:
        model: What to draw.
    """
    number = {vertex: f"{vertex.kind.value}{at}" for at, vertex in enumerate(model.vertices)}
    lines = ["flowchart LR"]
    for vertex in model.vertices:
        begin, end = _SHAPES[vertex.kind]
        lines.append(f"  {number[vertex]}{begin}{_quoted(vertex.label)}{end}:::{vertex.kind.value}s")
    for edge in model.edges:
        label = MISMATCH if edge in model.apart else ", ".join(edge.names)
        lines.append(f"  {number[edge.source]} {_arrow(edge, label)} {number[edge.target]}")
    if apart := ",".join(str(at) for at, edge in enumerate(model.edges) if edge in model.apart):
        lines.append(f"  linkStyle {apart} stroke:{MISMATCH_COLOR},color:{MISMATCH_COLOR},stroke-dasharray:4")
    return "\n".join([*lines, *_CLASSES])


def _arrow(edge: Edge, label: str) -> str:
    arrow = "-.->" if edge.relation in _DASHED else "-->"
    return f"{arrow}|{_quoted(label)}|" if label else arrow


def _quoted(text: str) -> str:
    """Return a string as a quoted Mermaid string, with special characters as entity codes."""
    return '"' + _SPECIAL.sub(lambda char: f"#{ord(char[0])};", escape(text)) + '"'
