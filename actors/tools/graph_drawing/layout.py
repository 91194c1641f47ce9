"""The position of everything in a drawing: columns from left to right, and heights in text rows or pixels.

A wire is drawn as segments between things in neighbouring columns. Where a wire passes a column, a thing that
is only a line reserves its place; wires of one hub share these lines, so that they part as late as possible.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.tools.graph_drawing.layering import folded, layers_of
from actors.tools.graph_drawing.ordering import ordered
from actors.tools.graph_drawing.placing import Wish, placed
from actors.tools.graph_drawing.wiring import Flow

if TYPE_CHECKING:
    from actors.tools.graph_drawing.wiring import Wiring

_SWEEPS: Final = 16
_BALANCING: Final = 24
"""Rounds that place things between their neighbours on both sides."""
_LINE_WEIGHT: Final = 8.0
"""The weight of a line that passes a column: it should be straight."""
_LOOSE_WEIGHT: Final = 0.01
"""The weight of a thing without neighbours on this side."""


class Measure(NamedTuple):
    """The sizes of one kind of drawing. Lines meet a node at ports, one for each hub.

    Attributes:
        node: The height of a node with one port.
        hub: The height of a hub.
        line: The height of a line that passes a column.
        step: The distance between two ports of a node.
        gap: The least space between two things of a column.
        whole: Everything is measured in whole rows of text.
    """

    node: float
    hub: float
    line: float
    step: float
    gap: float
    whole: bool


@dataclass(slots=True)
class Thing:
    """A node, a hub, or a line that passes (neither).

    Attributes:
        column: The column it is in.
        node: The index of the node.
        hub: The index of the hub.
        height: Its height.
        top: The height at which it begins.
        left: The segments that come from the left, from top to bottom.
        right: The segments that go to the right, from top to bottom.
    """

    column: int
    node: int | None = None
    hub: int | None = None
    height: float = 0.0
    top: float = 0.0
    left: list[int] = field(default_factory=list[int])
    right: list[int] = field(default_factory=list[int])

    @property
    def is_line(self) -> bool:
        """Whether it is only a line that passes."""
        return self.node is None and self.hub is None


class Segment(NamedTuple):
    """A piece of a hub's wires between things in neighbouring columns.

    Attributes:
        left, right: The indices of these things.
        hub: The index of the hub.
        head_left, head_right: Whether there is an arrow head at this end.
        apart: Whether it leads to a node that the hub does not connect with another one.
    """

    left: int
    right: int
    hub: int
    head_left: bool
    head_right: bool
    apart: bool = False


class Layout:
    """The layout of a connected wiring.

    Args:
        wiring: One or more wires.
        measure: The sizes of things.
        last_column: Fold the columns after this one back to the left, so that the drawing is narrower.

    Attributes:
        wiring: The wiring.
        things: All things.
        segments: All segments.
        columns: The indices of the things in each column, from top to bottom.
        height: Where the lowest thing ends; the highest begins at 0.
    """

    def __init__(self, wiring: Wiring, measure: Measure, *, last_column: int | None = None) -> None:
        self.wiring = wiring
        self.things: list[Thing] = []
        self.segments: list[Segment] = []
        self._measure = measure
        self._ports_left: dict[Segment, float] = {}
        self._ports_right: dict[Segment, float] = {}
        self._add_wires(folded(layers_of(wiring), last_column))
        by_column: list[list[int]] = [[] for _ in range(max(thing.column for thing in self.things) + 1)]
        for at, thing in enumerate(self.things):
            by_column[thing.column].append(at)
        self.columns = ordered(by_column, [(each.left, each.right) for each in self.segments])
        self._connect()
        self._place()
        self.height = max(thing.top + thing.height for thing in self.things)

    def port_left(self, segment: Segment) -> float:
        """Return the height at which a segment begins, on the right side of its left thing.

        Args:
            segment: One of the layout's.
        """
        return self.things[segment.left].top + self._ports_left[segment]

    def port_right(self, segment: Segment) -> float:
        """Return the height at which a segment ends, on the left side of its right thing.

        Args:
            segment: One of the layout's.
        """
        return self.things[segment.right].top + self._ports_right[segment]

    def _add_wires(self, columns: list[int]) -> None:
        """Make the things and the segments."""
        nodes, hubs = len(self.wiring.nodes), len(self.wiring.hubs)
        self.things += [Thing(columns[node], node=node) for node in range(nodes)]
        self.things += [Thing(columns[nodes + hub], hub=hub) for hub in range(hubs)]
        ends: list[dict[int, Flow]] = [{} for _ in range(hubs)]
        for (node, hub), flow in sorted(self.wiring.wires.items()):
            ends[hub][node] = flow
        for hub, flows in enumerate(ends):
            own = columns[nodes + hub]
            for step in (-1, 1):
                side = {node: flow for node, flow in flows.items() if (columns[node] - own) * step > 0}
                self._add_side(hub, nodes + hub, side, step)

    def _add_side(self, hub: int, start: int, flows: dict[int, Flow], step: int) -> None:
        """Add a hub's wires on one side, column by column away from the hub."""
        at, column, left = start, self.things[start].column, dict(flows)
        is_label = self.wiring.hubs[hub].vertex is None
        while left:
            column += step
            at_hub = at == start and not is_label
            for node in [node for node in left if self.things[node].column == column]:
                flow = left.pop(node)
                to_hub = at_hub and bool(flow & Flow.TO_HUB)
                heads = (to_hub, bool(flow & Flow.FROM_HUB))
                self._join(at, node, hub, step, heads=heads, apart=bool(flow & Flow.APART))
            if left:
                self.things.append(Thing(column))
                passing = len(self.things) - 1
                to_hub = at_hub and any(flow & Flow.TO_HUB for flow in left.values())
                apart = all(flow & Flow.APART for flow in left.values())
                self._join(at, passing, hub, step, heads=(to_hub, False), apart=apart)
                at = passing

    def _join(
        self, near: int, far: int, hub: int, step: int, *, heads: tuple[bool, bool], apart: bool
    ) -> None:
        """Add a segment from a thing nearer to the hub to one farther from it."""
        if step > 0:
            self.segments.append(Segment(near, far, hub, *heads, apart=apart))
        else:
            self.segments.append(Segment(far, near, hub, *heads[::-1], apart=apart))

    def _offset(self, thing: Thing, port: int, ports: int) -> float:
        """Return the distance of a port from its thing's top. Only a node has several on a side."""
        if thing.node is None:
            port, ports = 0, 1
        first = (thing.height - self._measure.whole - (ports - 1) * self._measure.step) / 2
        return (math.floor(first) if self._measure.whole else first) + port * self._measure.step

    def _connect(self) -> None:
        """Sort the segments of each thing by their other ends; set heights and ports."""
        rank = {thing: at for column in self.columns for at, thing in enumerate(column)}
        for at, segment in enumerate(self.segments):
            self.things[segment.left].right.append(at)
            self.things[segment.right].left.append(at)
        measure = self._measure
        for thing in self.things:
            thing.left.sort(key=lambda at: rank[self.segments[at].left])
            thing.right.sort(key=lambda at: rank[self.segments[at].right])
            if thing.node is not None:
                ports = max(len(thing.left), len(thing.right), 1)
                thing.height = measure.node + (ports - 1) * measure.step
            else:
                thing.height = measure.line if thing.hub is None else measure.hub
            for port, at in enumerate(thing.left):
                self._ports_right[self.segments[at]] = self._offset(thing, port, len(thing.left))
            for port, at in enumerate(thing.right):
                self._ports_left[self.segments[at]] = self._offset(thing, port, len(thing.right))

    def _place(self) -> None:
        for column in self.columns:
            top = 0.0
            for at in column:
                self.things[at].top = top
                top += self.things[at].height + self._measure.gap
        count = len(self.columns)
        for sweep in range(_SWEEPS):
            rightward = sweep % 2 == 0
            for number in range(1, count) if rightward else range(count - 2, -1, -1):
                self._place_column(self.columns[number], left=rightward, right=not rightward)
        for _ in range(_BALANCING):
            for column in self.columns:
                self._place_column(column, left=True, right=True)
        if self._measure.whole:
            for number, column in enumerate(self.columns):
                self._place_column(column, left=number > 0, right=False, whole=True)
        first = min(thing.top for thing in self.things)
        for thing in self.things:
            thing.top -= first

    def _place_column(self, column: list[int], *, left: bool, right: bool, whole: bool = False) -> None:
        """Place the things of a column near their neighbours on the left, on the right, or both."""
        wishes = [self._wish(at, left=left, right=right) for at in column]
        for at, top in zip(column, placed(wishes, whole=whole), strict=True):
            self.things[at].top = top

    def _wish(self, at: int, *, left: bool, right: bool) -> Wish:
        thing = self.things[at]
        total = weight = 0.0
        for number in (thing.left if left else []) + (thing.right if right else []):
            segment = self.segments[number]
            here, there = self.port_right(segment), self.port_left(segment)
            if segment.left == at:
                here, there = there, here
            passing = self.things[segment.left].is_line + self.things[segment.right].is_line
            pull = _LINE_WEIGHT**passing
            total += pull * (thing.top + there - here)
            weight += pull
        height = thing.height + self._measure.gap
        if not weight:
            return Wish(thing.top, _LOOSE_WEIGHT, height)
        return Wish(total / weight, weight, height)
