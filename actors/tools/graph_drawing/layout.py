"""Where everything stands: columns from left to right, and heights, in rows of text or in pixels.

A wire is drawn as segments, each from a thing in one column to one in the next. Where a wire passes columns
between, a thing that is only a line holds its place; wires of one hub share these, so that they part late.
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
_CALMING: Final = 24
"""Rounds in which things come to rest between their neighbours on both sides."""
_LINE_WEIGHT: Final = 8.0
"""How much more it matters that a line which passes a column is straight."""
_LOOSE_WEIGHT: Final = 0.01
"""What a thing weighs that nothing on this side pulls."""


class Measure(NamedTuple):
    """The sizes of one kind of drawing. Lines meet a node at ports, one for each hub, `step` apart."""

    node: float
    """The height of a node with one port."""
    hub: float
    line: float
    step: float
    gap: float
    """At least so much is free between two things of a column."""
    whole: bool
    """Everything is measured in rows of text."""


@dataclass(slots=True)
class Thing:
    """What stands in a column: a node, a hub, or a line that passes (neither)."""

    column: int
    node: int | None = None
    hub: int | None = None
    height: float = 0.0
    top: float = 0.0
    left: list[int] = field(default_factory=list[int])
    """The segments that come from the left, from above to below."""
    right: list[int] = field(default_factory=list[int])


class Segment(NamedTuple):
    """A piece of a hub's wires, between things in columns side by side. A head is an arrow's."""

    left: int
    right: int
    hub: int
    head_left: bool
    head_right: bool


class Layout:
    """A connected wiring, laid out.

    Args:
        wiring: What to show: one or more wires.
        measure: How large things are.
        last_column: Fold what goes on after this column back to the left, so that it is not as wide.

    Attributes:
        wiring: What it shows.
        things: All things.
        segments: All segments, by their things' indices.
        columns: The things of each column, from above to below.
        height: Where the lowest thing ends; the highest begins at 0.
    """

    def __init__(self, wiring: Wiring, measure: Measure, *, last_column: int | None = None) -> None:
        self.wiring = wiring
        self.things: list[Thing] = []
        self.segments: list[Segment] = []
        self._measure = measure
        self._ports_left: dict[Segment, float] = {}
        self._ports_right: dict[Segment, float] = {}
        _Laying(wiring, self.things, self.segments).lay(folded(layers_of(wiring), last_column))
        by_column: list[list[int]] = [[] for _ in range(max(thing.column for thing in self.things) + 1)]
        for at, thing in enumerate(self.things):
            by_column[thing.column].append(at)
        self.columns = ordered(by_column, [(each.left, each.right) for each in self.segments])
        self._connect()
        self._place()
        self.height = max(thing.top + thing.height for thing in self.things)

    def port_left(self, segment: Segment) -> float:
        """Return the height at which a segment begins, on the right side of its left thing."""
        return self.things[segment.left].top + self._ports_left[segment]

    def port_right(self, segment: Segment) -> float:
        """Return the height at which a segment ends, on the left side of its right thing."""
        return self.things[segment.right].top + self._ports_right[segment]

    def _offset(self, thing: Thing, port: int, ports: int) -> float:
        """Return how far below a thing's top a port is. Only a node has more than one on a side."""
        if thing.node is None:
            port, ports = 0, 1
        first = (thing.height - self._measure.whole - (ports - 1) * self._measure.step) / 2
        return (math.floor(first) if self._measure.whole else first) + port * self._measure.step

    def _connect(self) -> None:
        """Tell things their segments, in the order of what is at the other end, and how high they are."""
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
                self._settle(self.columns[number], left=rightward, right=not rightward)
        for _ in range(_CALMING):
            for column in self.columns:
                self._settle(column, left=True, right=True)
        if self._measure.whole:
            for number, column in enumerate(self.columns):
                self._settle(column, left=number > 0, right=False, whole=True)
        first = min(thing.top for thing in self.things)
        for thing in self.things:
            thing.top -= first

    def _settle(self, column: list[int], *, left: bool, right: bool, whole: bool = False) -> None:
        """Place a column's things near those on its left, its right, or both."""
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
            passing = _is_line(self.things[segment.left]) + _is_line(self.things[segment.right])
            pull = _LINE_WEIGHT**passing
            total += pull * (thing.top + there - here)
            weight += pull
        height = thing.height + self._measure.gap
        if not weight:
            return Wish(thing.top, _LOOSE_WEIGHT, height)
        return Wish(total / weight, weight, height)


def _is_line(thing: Thing) -> bool:
    return thing.node is None and thing.hub is None


class _Laying:
    """Lays the wires: makes things and segments of nodes, hubs and wires."""

    def __init__(self, wiring: Wiring, things: list[Thing], segments: list[Segment]) -> None:
        self._wiring = wiring
        self._things = things
        self._segments = segments

    def lay(self, columns: list[int]) -> None:
        nodes, hubs = len(self._wiring.nodes), len(self._wiring.hubs)
        self._things += [Thing(columns[node], node=node) for node in range(nodes)]
        self._things += [Thing(columns[nodes + hub], hub=hub) for hub in range(hubs)]
        ends: list[dict[int, Flow]] = [{} for _ in range(hubs)]
        for (node, hub), flow in sorted(self._wiring.wires.items()):
            ends[hub][node] = flow
        for hub, flows in enumerate(ends):
            own = columns[nodes + hub]
            for step in (-1, 1):
                side = {node: flow for node, flow in flows.items() if (columns[node] - own) * step > 0}
                self._lay_side(hub, nodes + hub, side, step)

    def _lay_side(self, hub: int, start: int, flows: dict[int, Flow], step: int) -> None:
        """Lay a hub's wires on one side, column by column away from it."""
        at, column, left = start, self._things[start].column, dict(flows)
        is_label = self._wiring.hubs[hub].vertex is None
        while left:
            column += step
            here = [node for node in left if self._things[node].column == column]
            for node in here:
                flow = left.pop(node)
                to_hub = at == start and not is_label and bool(flow & Flow.TO_HUB)
                self._join(at, node, hub, step, heads=(to_hub, bool(flow & Flow.FROM_HUB)))
            if left:
                passing = len(self._things)
                self._things.append(Thing(column))
                to_hub = at == start and not is_label and any(flow & Flow.TO_HUB for flow in left.values())
                self._join(at, passing, hub, step, heads=(to_hub, False))
                at = passing

    def _join(self, near: int, far: int, hub: int, step: int, *, heads: tuple[bool, bool]) -> None:
        """Add a segment from a thing nearer to the hub to one farther from it."""
        if step > 0:
            self._segments.append(Segment(near, far, hub, *heads))
        else:
            self._segments.append(Segment(far, near, hub, *heads[::-1]))
