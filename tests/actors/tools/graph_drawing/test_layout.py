"""Any graph can be laid out: nothing overlaps, and every wire is there."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.tools.graph_drawing.layering import folded, folds, layers_of
from actors.tools.graph_drawing.layout import Layout, Measure
from actors.tools.graph_drawing.model import Kind, Vertex
from actors.tools.graph_drawing.text import TextDrawing
from actors.tools.graph_drawing.wiring import Flow, Hub, Wiring, parts_of

ROWS = Measure(node=3, hub=1, line=1, step=1, gap=0, whole=True)
PIXELS = Measure(node=42, hub=28, line=12, step=20, gap=20, whole=False)
FOLDS = st.one_of(st.none(), st.integers(1, 7))


@st.composite
def wirings(draw: st.DrawFn) -> Wiring:
    """Return any connected wiring of up to 12 nodes and 12 hubs, labels among them."""
    pairs = st.tuples(st.integers(0, 11), st.integers(0, 11))
    flows = st.sampled_from([Flow.TO_HUB, Flow.FROM_HUB, Flow.TO_HUB | Flow.FROM_HUB])
    wires = draw(st.dictionaries(pairs, flows, min_size=1, max_size=40))
    nodes = [Vertex(Kind.NODE, f"/node{at}") for at in range(12)]
    hubs = [
        Hub(f"/hub{at}", Kind.TOPIC, Vertex(Kind.TOPIC, f"/hub{at}") if at % 4 else None) for at in range(12)
    ]
    used = sorted({hub for _, hub in wires})
    wires = {(node, used.index(hub)): flow for (node, hub), flow in wires.items()}
    hubs = [hubs[hub] for hub in used]
    parts, _ = parts_of(Wiring(nodes, hubs, wires))
    return parts[0]


def chain(*flows: tuple[int, int, Flow]) -> Wiring:
    """Return a wiring of a few nodes and topics."""
    nodes = [Vertex(Kind.NODE, f"/n{at}") for at in range(1 + max(node for node, _, _ in flows))]
    hubs = [
        Hub(f"/t{at}", Kind.TOPIC, Vertex(Kind.TOPIC, f"/t{at}"))
        for at in range(1 + max(hub for _, hub, _ in flows))
    ]
    return Wiring(nodes, hubs, {(node, hub): flow for node, hub, flow in flows})


def test_arrows_go_right() -> None:
    """Without a circle none goes back."""
    wiring = chain((0, 0, Flow.TO_HUB), (1, 0, Flow.FROM_HUB), (1, 1, Flow.TO_HUB), (2, 1, Flow.FROM_HUB))
    assert layers_of(wiring) == [0, 2, 4, 1, 3]


def test_a_circle_is_opened_once() -> None:
    """One wire of it goes back."""
    ends = [(0, 0), (1, 1), (2, 2)]
    wires = [(node, hub, Flow.TO_HUB) for node, hub in ends]
    wires += [((node + 1) % 3, hub, Flow.FROM_HUB) for node, hub in ends]
    wiring = chain(*wires)
    columns = layers_of(wiring)
    back = [
        (node, hub)
        for node, hub, flow in wires
        if (columns[node] > columns[3 + hub]) is (flow is Flow.TO_HUB)
    ]
    assert len(back) == 1


def test_a_source_stands_near_its_targets() -> None:
    """Not in the first column, if its topic is needed far on the right only."""
    wires = [(0, 0, Flow.TO_HUB), (1, 0, Flow.FROM_HUB), (1, 1, Flow.TO_HUB), (2, 1, Flow.FROM_HUB)]
    wiring = chain(*wires, (3, 2, Flow.TO_HUB), (2, 2, Flow.FROM_HUB))
    columns = layers_of(wiring)
    assert columns[3] == 2
    assert columns[4 + 2] == 3


@given(wirings())
def test_nodes_and_hubs_take_turns(wiring: Wiring) -> None:
    """A wire never has both its ends in one column, however it is folded."""
    for last in (None, 1, 2, 5):
        columns = folded(layers_of(wiring), last)
        count = len(wiring.nodes)
        assert min(columns) == 0
        assert all((columns[node] - columns[count + hub]) % 2 for node, hub in wiring.wires)
        assert last is None or max(columns) <= last


def test_folding_goes_back_and_forth() -> None:
    """As a sheet of paper is folded, so that neighbours stay neighbours."""
    assert folded(list(range(8)), 3) == [0, 1, 2, 3, 2, 1, 0, 1]


def test_only_folds_that_might_do_are_tried() -> None:
    """A chain of six, each 10 wide with 2 between: 40 columns have room for three of them."""
    assert list(folds(list(range(6)), [10.0] * 6, between=2, max_width=40, fewest=2)) == [2, 1]
    assert list(folds(list(range(6)), [10.0] * 6, between=2, max_width=100, fewest=4)) == [5, 4, 3]
    assert list(folds([0, 1], [10.0] * 2, between=2, max_width=22, fewest=4)) == [1]
    assert list(folds([0, 1], [10.0] * 2, between=2, max_width=21, fewest=4)) == []


@pytest.mark.parametrize("measure", [ROWS, PIXELS], ids=["rows", "pixels"])
@given(wiring=wirings(), last=FOLDS)
def test_nothing_overlaps(measure: Measure, wiring: Wiring, last: int | None) -> None:
    """Things of a column stand one below the other with the gap between; lines meet a node within its box."""
    layout = Layout(wiring, measure, last_column=last)
    for column in layout.columns:
        for above, below in pairwise(layout.things[at] for at in column):
            assert above.top + above.height + measure.gap <= below.top + 1e-6
    for segment in layout.segments:
        for at, port in ((segment.left, layout.port_left), (segment.right, layout.port_right)):
            thing = layout.things[at]
            assert thing.top <= port(segment) <= thing.top + thing.height - measure.whole
    assert min(thing.top for thing in layout.things) == 0
    assert max(thing.top + thing.height for thing in layout.things) == layout.height


@given(wiring=wirings(), last=FOLDS)
def test_every_wire_is_there(wiring: Wiring, last: int | None) -> None:
    """From each node segments lead to its hub, with heads at the ends that data goes to."""
    layout = Layout(wiring, ROWS, last_column=last)
    assert {thing.node for thing in layout.things} - {None} == set(range(len(wiring.nodes)))
    for (node, hub), flow in wiring.wires.items():
        at = next(number for number, thing in enumerate(layout.things) if thing.node == node)
        ends = [each for each in layout.segments if each.hub == hub and at in {each.left, each.right}]
        assert len(ends) == 1
        head = ends[0].head_left if ends[0].left == at else ends[0].head_right
        assert head is bool(flow & Flow.FROM_HUB)
        assert hub in {layout.things[other].hub for other in _reached(layout, at, hub)}


@given(wiring=wirings(), last=FOLDS)
def test_a_hub_has_a_head_where_data_comes_in(wiring: Wiring, last: int | None) -> None:
    """A label has none: the line goes on under it."""
    layout = Layout(wiring, ROWS, last_column=last)
    for number, hub in enumerate(wiring.hubs):
        at = next(place for place, thing in enumerate(layout.things) if thing.hub == number)
        heads = [
            each.head_left if each.left == at else each.head_right
            for each in layout.segments
            if at in {each.left, each.right}
        ]
        fed = any(flow & Flow.TO_HUB for (_, other), flow in wiring.wires.items() if other == number)
        assert any(heads) is (fed and hub.vertex is not None)


def _reached(layout: Layout, start: int, hub: int) -> set[int]:
    """Return the things that a hub's segments join to one of them."""
    reached, waiting = {start}, [start]
    while waiting:
        at = waiting.pop()
        for segment in layout.segments:
            if segment.hub == hub and at in {segment.left, segment.right}:
                other = segment.left + segment.right - at
                if other not in reached:
                    reached.add(other)
                    waiting.append(other)
    return reached


UP, RIGHT, DOWN, LEFT = 1, 2, 4, 8


@given(wiring=wirings(), last=FOLDS)
def test_lines_of_text_can_be_told_apart(wiring: Wiring, last: int | None) -> None:
    """On one spot two hubs' lines at most cross: one goes up and down, the other across."""
    drawing = TextDrawing(Layout(wiring, ROWS, last_column=last), 0)
    for hubs in drawing.canvas.line_cells.values():
        assert len(hubs) <= 2
        if len(hubs) == 2:
            assert sorted(hubs.values()) == [UP | DOWN, LEFT | RIGHT]


@given(wiring=wirings(), last=FOLDS)
def test_lines_of_text_join_each_hub_and_its_nodes(wiring: Wiring, last: int | None) -> None:
    """On either side of a label there is one connected line, and all segments of that side end on it."""
    layout = Layout(wiring, ROWS, last_column=last)
    drawing = TextDrawing(layout, 0)
    for hub in range(len(wiring.hubs)):
        cells = {spot: hubs[hub] for spot, hubs in drawing.canvas.line_cells.items() if hub in hubs}
        thing = next(each for each in layout.things if each.hub == hub)
        assert len(_stretches(cells)) == bool(thing.left) + bool(thing.right)
        for segment in layout.segments:
            if segment.hub == hub:
                column = layout.things[segment.left].column
                begin = drawing.lefts[column] + drawing.widths[column]
                assert (round(layout.port_left(segment)), begin) in cells
                assert (round(layout.port_right(segment)), drawing.lefts[column + 1] - 1) in cells


def _stretches(cells: dict[tuple[int, int], int]) -> list[set[tuple[int, int]]]:
    """Return the connected stretches of one hub's line."""
    steps = {UP: (-1, 0), DOWN: (1, 0), LEFT: (0, -1), RIGHT: (0, 1)}
    left = set(cells)
    stretches: list[set[tuple[int, int]]] = []
    while left:
        waiting = [left.pop()]
        stretch = set(waiting)
        while waiting:
            row, column = waiting.pop()
            for bit, (down, right) in steps.items():
                spot = (row + down, column + right)
                if cells[row, column] & bit and spot in left:
                    left.remove(spot)
                    stretch.add(spot)
                    waiting.append(spot)
        stretches.append(stretch)
    return stretches
