"""A drawing of the graph in characters, for a terminal; or a listing, if the terminal is too narrow.

Nodes are boxes; topics are between them, with solid lines; services are in brackets, with dashed lines. A red
cross instead of an arrow head marks a node that does not match another one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.canvas import Canvas, Paint
from actors.tools.graph_drawing.channel import Net, routed
from actors.tools.graph_drawing.layering import folds, layers_of
from actors.tools.graph_drawing.layout import Layout, Measure
from actors.tools.graph_drawing.model import MISMATCH, Kind, Relation
from actors.tools.graph_drawing.wiring import parts_of, wiring_of
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.layout import Segment
    from actors.tools.graph_drawing.model import Edge, GraphModel, Vertex
    from actors.tools.graph_drawing.wiring import Hub, Wiring

MAX_DRAWN: Final = 200
"""Vertices, and labels of arrows from node to node; beyond it a listing is easier to read."""
MAX_DRAWN_EDGES: Final = 400
"""Beyond it there are too many lines to follow."""
USUAL_WIDTH: Final = 100
"""Columns for nodes without wires, if no width is given."""
_MEASURE: Final = Measure(node=3, hub=1, line=1, step=1, gap=0, whole=True)
_FEWEST_COLUMNS: Final = 3
"""A drawing folded more often than to this is harder to read than a listing."""
_NODE_PADDING: Final = 4
_CROSS: Final = "✗"
_SHORTEST: Final = 3
"""Columns of a line that stays on its row."""


def text_of(
    model: GraphModel, *, width: int | None = None, color: bool = False, ascii_only: bool = False
) -> str:
    """Return a drawing of a model, or a listing if it does not fit.

    Args:
        model: What to draw.
        width: The columns of the terminal; None for no limit.
        color: Use colours, by escape sequences.
        ascii_only: Use no box characters.

    Returns:
        Lines, without a final newline; empty for an empty model.
    """
    lines = None
    labels = sum(1 for edge in model.edges if edge.names)
    if len(model.vertices) + labels <= MAX_DRAWN and len(model.edges) <= MAX_DRAWN_EDGES:
        lines = _drawn(model, width, color=color, ascii_only=ascii_only)
    if lines is None:
        return listing_of(model)
    return "\n".join(lines)


def listing_of(model: GraphModel) -> str:
    """Return a model as lines: each node and, indented, what it does.

    Args:
        model: What to list.
    """
    nodes = model.of_kind(Kind.NODE)
    actions: dict[Vertex, list[str]] = {node: [] for node in nodes}
    for edge in model.edges:
        apart = f" ({MISMATCH})" if edge in model.apart else ""
        if edge.source.kind is Kind.NODE:
            actions[edge.source].append(_action(edge) + apart)
        else:
            actions[edge.target].append(f"{edge.relation.value} {escape(edge.source.label)}{apart}")
    lines: list[str] = []
    for node in nodes:
        lines.append(escape(node.label))
        lines += [f"  {each}" for each in sorted(actions[node])]
    return "\n".join(lines)


def _action(edge: Edge) -> str:
    target = escape(edge.target.label)
    if not edge.names:
        return f"{edge.relation.value} {target}"
    names = ", ".join(map(escape, edge.names))
    preposition = "to" if edge.relation is Relation.PUBLISHES else "of"
    return f"{edge.relation.value} {names} {preposition} {target}"


def _drawn(model: GraphModel, width: int | None, *, color: bool, ascii_only: bool) -> list[str] | None:
    """Return the lines of the drawing; None if it does not fit."""
    parts, alone = parts_of(wiring_of(model))
    canvases: list[Canvas] = []
    first_hub = 0
    for part in parts:
        drawing = _fitting(part, width, first_hub)
        if drawing is None:
            return None
        canvases.append(drawing.canvas)
        first_hub += len(part.hubs)
    boxes = _boxes(alone, USUAL_WIDTH if width is None else width)
    if boxes is None:
        return None
    lines: list[str] = []
    for canvas in [*canvases, boxes]:
        drawn = canvas.lines(color=color, ascii_only=ascii_only)
        lines += ["", *drawn] if lines and drawn else drawn
    return lines


def _fitting(part: Wiring, width: int | None, first_hub: int) -> TextDrawing | None:
    """Draw a connected part, folded until it fits; None if it cannot fit."""
    if width is None:
        return TextDrawing(Layout(part, _MEASURE), first_hub)
    widths: list[float] = [len(escape(node.label)) + _NODE_PADDING for node in part.nodes]
    widths += [len(_label(hub)) for hub in part.hubs]
    for last in folds(layers_of(part), widths, between=_SHORTEST, max_width=width, fewest=_FEWEST_COLUMNS):
        drawing = TextDrawing(Layout(part, _MEASURE, last_column=last), first_hub)
        if drawing.width <= width:
            return drawing
    return None


def _boxes(nodes: list[Vertex], width: int) -> Canvas | None:
    """Draw nodes side by side, in rows; None if one is too wide."""
    canvas = Canvas()
    top = left = 0
    for node in nodes:
        name = escape(node.label)
        if len(name) + 4 > width:
            return None
        if left + len(name) + 4 > width:
            top, left = top + 3, 0
        canvas.box(top, left, len(name) + 4, 3)
        canvas.write(top + 1, left + 2, name, Paint.NODE)
        left += len(name) + 5
    return canvas


class TextDrawing:
    """A layout on a canvas.

    Args:
        layout: The layout, in rows of text.
        first_hub: The number of the first hub, which selects its colour.

    Attributes:
        canvas: The drawing.
        width: Its width in characters.
        lefts: The first character column of each column of the layout.
        widths: The width of each column of the layout.
    """

    def __init__(self, layout: Layout, first_hub: int) -> None:
        self.canvas = Canvas()
        self._layout = layout
        self._first_hub = first_hub
        for hub, each in enumerate(layout.wiring.hubs):
            if each.kind is Kind.SERVICE:
                self.canvas.dash(first_hub + hub)
        self.widths = [max(map(self._width_of, column)) for column in layout.columns]
        self.lefts: list[int] = []
        self._rows = round(layout.height)
        left = 0
        for number, column in enumerate(layout.columns):
            self.lefts.append(left)
            left += self.widths[number]
            if number + 1 < len(layout.columns):
                left += self._draw_channel(column, left)
        self.width = left
        for number, column in enumerate(layout.columns):
            for at in column:
                self._draw_thing(at, self.lefts[number], self.widths[number])

    def _width_of(self, at: int) -> int:
        thing = self._layout.things[at]
        if thing.node is not None:
            return len(escape(self._layout.wiring.nodes[thing.node].label)) + _NODE_PADDING
        return 0 if thing.hub is None else len(_label(self._layout.wiring.hubs[thing.hub]))

    def _draw_thing(self, at: int, left: int, width: int) -> None:
        thing = self._layout.things[at]
        row, height = round(thing.top), round(thing.height)
        if thing.node is not None:
            self.canvas.box(row, left, width, height)
            name = escape(self._layout.wiring.nodes[thing.node].label)
            self.canvas.write(row + (height - 1) // 2, left + 2, name, Paint.NODE)
            self._draw_ports(at, left, width)
        elif thing.hub is None:
            hub = self._first_hub + self._layout.segments[thing.left[0]].hub
            self.canvas.across(hub, row, left - 1, left + width)
        else:
            self._draw_hub(at, left, width)

    def _draw_ports(self, at: int, left: int, width: int) -> None:
        """Draw the points where lines without a head meet a box."""
        thing = self._layout.things[at]
        for segment in (self._layout.segments[each] for each in thing.left):
            if segment.apart:
                self.canvas.write(round(self._layout.port_right(segment)), left - 1, _CROSS, Paint.BAD)
            if not segment.head_right:
                self.canvas.write(round(self._layout.port_right(segment)), left, "┤")
        for segment in (self._layout.segments[each] for each in thing.right):
            if segment.apart:
                self.canvas.write(round(self._layout.port_left(segment)), left + width, _CROSS, Paint.BAD)
            if not segment.head_left:
                self.canvas.write(round(self._layout.port_left(segment)), left + width - 1, "├")

    def _draw_hub(self, at: int, left: int, width: int) -> None:
        """Draw a hub's label, with its line and head up to the right end of its column."""
        thing = self._layout.things[at]
        assert thing.hub is not None
        row, hub = round(thing.top), self._first_hub + thing.hub
        label = _label(self._layout.wiring.hubs[thing.hub])
        if thing.right:
            self.canvas.across(hub, row, left + len(label), left + width)
        self.canvas.write_of(hub, row, left, label)
        if any(self._layout.segments[each].head_left for each in thing.right):
            self.canvas.write_of(hub, row, left + len(label), "◀")

    def _draw_channel(self, column: list[int], left: int) -> int:
        """Draw the lines between a column and the next one; return their width."""
        segments = [self._layout.segments[each] for at in column for each in self._layout.things[at].right]
        routes = routed(self._nets(segments), self._rows)
        self._rows = routes.rows
        lead = 1 + any(segment.head_left for segment in segments)
        width = max(_SHORTEST, 2 * routes.tracks + 1 + lead)
        for branch in routes.branches:
            begin = left - 1 if branch.begin < 0 else left + lead + 2 * branch.begin
            end = left + width if branch.end is None else left + lead + 2 * branch.end
            self.canvas.across(self._first_hub + branch.hub, branch.row, begin, end)
        for trunk in routes.trunks:
            self.canvas.down(
                self._first_hub + trunk.hub, left + lead + 2 * trunk.track, trunk.top, trunk.bottom
            )
        for segment in segments:
            self._draw_heads(segment, left, width)
        return width

    def _nets(self, segments: list[Segment]) -> list[Net]:
        rows: dict[int, tuple[set[int], set[int]]] = {}
        for segment in segments:
            on_left, on_right = rows.setdefault(segment.hub, (set(), set()))
            on_left.add(round(self._layout.port_left(segment)))
            on_right.add(round(self._layout.port_right(segment)))
        return [Net(hub, frozenset(ends[0]), frozenset(ends[1])) for hub, ends in rows.items()]

    def _draw_heads(self, segment: Segment, left: int, width: int) -> None:
        hub = self._first_hub + segment.hub
        if segment.head_left and self._layout.things[segment.left].node is not None:
            self.canvas.write_of(hub, round(self._layout.port_left(segment)), left, "◀")
        if segment.head_right:
            self.canvas.write_of(hub, round(self._layout.port_right(segment)), left + width - 1, "▶")


def _label(hub: Hub) -> str:
    return f" [{hub.label}] " if hub.kind is Kind.SERVICE else f" {hub.label} "
