"""A drawing of the graph in Mermaid, which Markdown viewers draw: paste it between ```mermaid and ```."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.model import Kind, Relation
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
    lines += [f"  {number[edge.source]} {_arrow(edge)} {number[edge.target]}" for edge in model.edges]
    return "\n".join([*lines, *_CLASSES])


def _arrow(edge: Edge) -> str:
    arrow = "-.->" if edge.relation in _DASHED else "-->"
    return f"{arrow}|{_quoted(', '.join(edge.names))}|" if edge.names else arrow


def _quoted(text: str) -> str:
    """Return a string as a quoted Mermaid string, with special characters as entity codes."""
    return '"' + _SPECIAL.sub(lambda char: f"#{ord(char[0])};", escape(text)) + '"'
