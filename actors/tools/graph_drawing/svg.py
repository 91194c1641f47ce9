"""A drawing of the graph as SVG: one file without scripts or fonts, light or dark like the page around it.

Nodes are rounded boxes, topics pills, services hexagons with dashed lines. Pointing at a topic or service
thickens its lines and shows its types. A line to a node that does not match another one is red and dotted.
"""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.layering import folds, layers_of
from actors.tools.graph_drawing.layout import Layout, Measure
from actors.tools.graph_drawing.model import DrawingTooLargeError, Kind
from actors.tools.graph_drawing.wiring import parts_of, wiring_of
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.tools.graph_drawing.layout import Segment
    from actors.tools.graph_drawing.model import GraphModel, Vertex
    from actors.tools.graph_drawing.wiring import Hub, Wiring

MAX_DRAWN: Final = 500
"""Vertices; with more, a drawing is slow to make and cannot be read."""
USUAL_WIDTH: Final = 1600.0
"""Pixels; a wider drawing is folded."""
_FEWEST_COLUMNS: Final = 4
_MEASURE: Final = Measure(node=42, hub=28, line=12, step=20, gap=20, whole=False)
_LETTER: Final = 7.83
"""Pixels per letter of the usual monospaced fonts at 13 pixels."""
_NODE_PADDING: Final = 34.0
_HUB_PADDING: Final = 30.0
_LABEL_PADDING: Final = 14.0
_LEAST_CHANNEL: Final = 56.0
_MARGIN: Final = 32.0
_BETWEEN_PARTS: Final = 36.0
_LEGEND: Final = 48.0

_STYLE: Final = """
  .callboard { font: 13px ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; }
  .callboard .paper, .callboard .label { fill: #ffffff; }
  .callboard text { fill: #1c2533; text-anchor: middle; dominant-baseline: central; }
  .callboard .node rect { fill: #eef3fb; stroke: #5b7fb5; stroke-width: 1.5; }
  .callboard .node text { font-weight: 600; }
  .callboard .shape { stroke-width: 1.5; }
  .callboard .wire { fill: none; stroke-width: 1.6; stroke-linecap: round; }
  .callboard .topic .shape { fill: #e6f5ee; stroke: #2f9068; }
  .callboard .topic .wire { stroke: #2f9068; }
  .callboard .topic .head { fill: #2f9068; }
  .callboard .service .shape { fill: #fdf1e2; stroke: #c67a22; }
  .callboard .service .wire { stroke: #c67a22; stroke-dasharray: 5 4; }
  .callboard .service .head { fill: #c67a22; }
  .callboard .wire.mismatch { stroke: #c0392b; stroke-dasharray: 2 4; }
  .callboard .topic:hover .wire, .callboard .service:hover .wire { stroke-width: 3.2; }
  .callboard .legend text { fill: #667085; font-size: 11px; font-weight: 400; text-anchor: start; }
  @media screen { .callboard { max-width: 100%; height: auto; } }
  @media (prefers-color-scheme: dark) {
    .callboard .paper, .callboard .label { fill: #12161d; }
    .callboard text { fill: #e4e9f1; }
    .callboard .legend text { fill: #98a2b3; }
    .callboard .node rect { fill: #1d2838; stroke: #7b9fd6; }
    .callboard .topic .shape { fill: #15302a; stroke: #4fb98d; }
    .callboard .topic .wire { stroke: #4fb98d; }
    .callboard .topic .head { fill: #4fb98d; }
    .callboard .service .shape { fill: #36270f; stroke: #e09c4a; }
    .callboard .service .wire { stroke: #e09c4a; }
    .callboard .service .head { fill: #e09c4a; }
    .callboard .wire.mismatch { stroke: #ff7b6b; } }
"""
"""Colours are literal: librsvg, Inkscape and CairoSVG support no `var()`. CairoSVG ignores `@media` rules,
and cannot read `height: auto`."""
_HEADS: Final = "".join(
    f'<marker id="callboard-{kind}" class="{kind}" viewBox="0 0 10 10" refX="9.5" refY="5" markerWidth="9" '
    'markerHeight="9" markerUnits="userSpaceOnUse" orient="auto-start-reverse">'
    '<path class="head" d="M0 0.5 L10 5 L0 9.5 Z"/></marker>\n'
    for kind in (Kind.TOPIC.value, Kind.SERVICE.value)
)
_SAMPLES: Final = {
    Kind.NODE: '<rect y="-7" width="22" height="14" rx="4"/>',
    Kind.TOPIC: '<rect class="shape" y="-7" width="22" height="14" rx="7"/>',
    Kind.SERVICE: '<path class="shape" d="M5 -7 h12 l5 7 l-5 7 h-12 l-5 -7 Z"/>',
}
_SAMPLE_STEP: Final = 88.0
_LEAST_WIDTH: Final = 250.0
_UNWRITABLE: Final = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def svg_of(model: GraphModel) -> str:
    """Return a model as an SVG document, without a final newline.

    Args:
        model: What to draw.

    Raises:
        DrawingTooLargeError: It has more than `MAX_DRAWN` vertices.
    """
    if len(model.vertices) > MAX_DRAWN:
        raise DrawingTooLargeError(
            f"{len(model.vertices)} nodes, topics and services are too many for a drawing"
        )
    parts, alone = parts_of(wiring_of(model))
    body: list[str] = []
    width, top = _LEAST_WIDTH, 0.0
    for part in parts:
        drawing = _folded(part, model)
        body.append(f'<g transform="translate(0 {_n(top)})">\n{drawing.body()}</g>')
        width = max(width, drawing.width)
        top += drawing.height + _BETWEEN_PARTS
    boxes, wide, high = _boxes(alone, max(width, USUAL_WIDTH / 2))
    if boxes:
        body.append(f'<g transform="translate(0 {_n(top)})">\n{boxes}</g>')
        width, top = max(width, wide), top + high + _BETWEEN_PARTS
    if not model.vertices:
        body.append(f'<text x="{_n(width / 2)}" y="20">no nodes</text>')
        top = 40 + _BETWEEN_PARTS
    return _document(model, "\n".join(body), width, top - _BETWEEN_PARTS)


def _document(model: GraphModel, body: str, width: float, height: float) -> str:
    wide, high = _n(width + 2 * _MARGIN), _n(height + 2 * _MARGIN + _LEGEND)
    counts = {kind: len(model.of_kind(kind)) for kind in Kind}
    described = ", ".join(f"{count} {kind.value}{'s' * (count != 1)}" for kind, count in counts.items())
    return "\n".join(
        [
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" class="callboard" role="img" width="{wide}" '
                f'height="{high}" viewBox="0 0 {wide} {high}" '
                'aria-labelledby="callboard-title callboard-told">'
            ),
            '<title id="callboard-title">Graph of nodes</title>',
            f'<desc id="callboard-told">{described}</desc>',
            f"<style>{_STYLE}</style>",
            f"<defs>\n{_HEADS}</defs>",
            f'<rect class="paper" width="{wide}" height="{high}"/>',
            f'<g transform="translate({_n(_MARGIN)} {_n(_MARGIN)})">',
            body,
            f'<g class="legend" aria-hidden="true" transform="translate(0 {_n(height + _LEGEND)})">',
            _legend(model),
            "</g>\n</g>\n</svg>",
        ]
    )


def _legend(model: GraphModel) -> str:
    """Explain the shapes that occur."""
    kinds = [kind for kind in _SAMPLES if model.of_kind(kind)]
    return "".join(
        f'<g class="{kind.value}" transform="translate({_n(at * _SAMPLE_STEP)} 0)">{_SAMPLES[kind]}'
        f'<text x="30">{kind.value}</text></g>'
        for at, kind in enumerate(kinds)
    )


def _boxes(nodes: list[Vertex], width: float) -> tuple[str, float, float]:
    """Return nodes side by side in rows, with their width and height."""
    body, left, top, wide = "", 0.0, 0.0, 0.0
    for node in nodes:
        node_width = _width(node.label) + _NODE_PADDING
        if left and left + node_width > width:
            left, top = 0.0, top + _MEASURE.node + _MEASURE.gap
        body += _node(node, left, top, node_width, _MEASURE.node)
        wide = max(wide, left + node_width)
        left += node_width + _MEASURE.gap
    return body, wide, top + _MEASURE.node


def _folded(part: Wiring, model: GraphModel) -> _Drawing:
    """Draw a connected part, folded until it is narrow enough, or as often as it stays readable."""
    widths = [_width(node.label) + _NODE_PADDING for node in part.nodes] + [
        _hub_width(hub) for hub in part.hubs
    ]
    columns = layers_of(part)
    for last in folds(columns, widths, between=_LEAST_CHANNEL, max_width=USUAL_WIDTH, fewest=_FEWEST_COLUMNS):
        drawing = _Drawing(Layout(part, _MEASURE, last_column=last), model)
        if drawing.width <= USUAL_WIDTH:
            return drawing
    fewest = min(max(columns), _FEWEST_COLUMNS - 1)
    return _Drawing(Layout(part, _MEASURE, last_column=fewest), model)


class _Drawing:
    """A layout in pixels: things are centred in their column, and lines turn between columns."""

    def __init__(self, layout: Layout, model: GraphModel) -> None:
        self._layout = layout
        self._model = model
        self._widths = [max(map(self._width_of, column)) for column in layout.columns]
        self._lefts: list[float] = []
        left = 0.0
        for number, width in enumerate(self._widths):
            self._lefts.append(left)
            left += width + self._channel(number)
        self.width = self._lefts[-1] + self._widths[-1]
        self.height = layout.height

    def body(self) -> str:
        """Return the elements: each hub with its lines, then the nodes."""
        wires: list[list[str]] = [[] for _ in self._layout.wiring.hubs]
        for segment in self._layout.segments:
            wires[segment.hub].append(self._wire(segment))
        for thing in self._layout.things:
            if thing.is_line:
                hub = self._layout.segments[thing.left[0]].hub
                wires[hub].append(self._passing(thing.column, thing.top + thing.height / 2))
        places = {thing.hub: at for at, thing in enumerate(self._layout.things) if thing.hub is not None}
        hubs = [self._hub(places[hub], each, wires[hub]) for hub, each in enumerate(self._layout.wiring.hubs)]
        nodes: list[str] = []
        for at, thing in enumerate(self._layout.things):
            if thing.node is not None:
                node = self._layout.wiring.nodes[thing.node]
                nodes.append(_node(node, self._left(at), thing.top, self._width_of(at), thing.height))
        return "".join(hubs + nodes)

    def _channel(self, number: int) -> float:
        """Return the space on the right of a column: more where lines go far up or down."""
        if number + 1 == len(self._layout.columns):
            return 0.0
        climbs = [
            abs(
                self._layout.port_left(self._layout.segments[each])
                - self._layout.port_right(self._layout.segments[each])
            )
            for at in self._layout.columns[number]
            for each in self._layout.things[at].right
        ]
        return _LEAST_CHANNEL + min(90.0, 0.22 * max(climbs, default=0))

    def _width_of(self, at: int) -> float:
        thing = self._layout.things[at]
        if thing.node is not None:
            return _width(self._layout.wiring.nodes[thing.node].label) + _NODE_PADDING
        return 0.0 if thing.hub is None else _hub_width(self._layout.wiring.hubs[thing.hub])

    def _left(self, at: int) -> float:
        column = self._layout.things[at].column
        return self._lefts[column] + (self._widths[column] - self._width_of(at)) / 2

    def _passing(self, column: int, height: float) -> str:
        left = self._lefts[column]
        return f'<path class="wire" d="M{_n(left)} {_n(height)} H{_n(left + self._widths[column])}"/>'

    def _wire(self, segment: Segment) -> str:
        """Return a segment: horizontal to the edge of its column, a curve, and horizontal again."""
        begin = self._left(segment.left) + self._width_of(segment.left)
        end = self._left(segment.right)
        if self._layout.things[segment.left].is_line:
            begin = self._lefts[self._layout.things[segment.left].column]
            begin += self._widths[self._layout.things[segment.left].column]
        if self._layout.things[segment.right].is_line:
            end = self._lefts[self._layout.things[segment.right].column]
        column = self._layout.things[segment.left].column
        turn, back = self._lefts[column] + self._widths[column], self._lefts[column + 1]
        from_y, to_y = self._layout.port_left(segment), self._layout.port_right(segment)
        middle = (turn + back) / 2
        path = f"M{_n(begin)} {_n(from_y)} H{_n(turn)} C{_n(middle)} {_n(from_y)} {_n(middle)} {_n(to_y)} "
        path += f"{_n(back)} {_n(to_y)} H{_n(end)}"
        head = f"url(#callboard-{self._layout.wiring.hubs[segment.hub].kind.value})"
        heads = f' marker-start="{head}"' if segment.head_left else ""
        heads += f' marker-end="{head}"' if segment.head_right else ""
        kind = "wire mismatch" if segment.apart else "wire"
        return f'<path class="{kind}" d="{path}"{heads}/>'

    def _hub(self, at: int, hub: Hub, wires: list[str]) -> str:
        left, width, thing = self._left(at), self._width_of(at), self._layout.things[at]
        types = self._model.types.get(hub.vertex, ()) if hub.vertex is not None else ()
        described = f"{hub.label} [{', '.join(types)}]" if types else hub.label
        middle = f'x="{_n(left + width / 2)}" y="{_n(thing.top + thing.height / 2)}"'
        return "\n".join(
            [
                f'<g class="{hub.kind.value}"><title>{_safe(described)}</title>',
                *wires,
                _shape(hub, left, thing.top, width, thing.height),
                f"<text {middle}>{_safe(hub.label)}</text></g>",
                "",
            ]
        )


def _shape(hub: Hub, left: float, top: float, width: float, height: float) -> str:
    if hub.vertex is None:
        return (
            f'<rect class="label" x="{_n(left)}" y="{_n(top + 4)}" width="{_n(width)}" '
            f'height="{_n(height - 8)}" rx="4"/>'
        )
    if hub.kind is Kind.TOPIC:
        return (
            f'<rect class="shape" x="{_n(left)}" y="{_n(top)}" width="{_n(width)}" height="{_n(height)}" '
            f'rx="{_n(height / 2)}"/>'
        )
    tip, half = 9, height / 2
    return (
        f'<path class="shape" d="M{_n(left + tip)} {_n(top)} h{_n(width - 2 * tip)} l{tip} {_n(half)} '
        f'l{-tip} {_n(half)} h{_n(2 * tip - width)} l{-tip} {_n(-half)} Z"/>'
    )


def _node(node: Vertex, left: float, top: float, width: float, height: float) -> str:
    place = f'x="{_n(left)}" y="{_n(top)}" width="{_n(width)}" height="{_n(height)}"'
    middle = f'x="{_n(left + width / 2)}" y="{_n(top + height / 2)}"'
    name = _safe(escape(node.label))
    return f'<g class="node"><rect {place} rx="10"/><text {middle}>{name}</text></g>\n'


def _width(name: str) -> float:
    return len(escape(name)) * _LETTER


def _hub_width(hub: Hub) -> float:
    return len(hub.label) * _LETTER + (_LABEL_PADDING if hub.vertex is None else _HUB_PADDING)


def _n(number: float) -> str:
    """Return a number, rounded to a tenth of a pixel."""
    return f"{round(number, 1) + 0.0:g}" if abs(number) < 1e5 else f"{number:.0f}"


def _safe(text: str) -> str:
    """Return a string, escaped for XML."""
    return html.escape(_UNWRITABLE.sub("?", text))
