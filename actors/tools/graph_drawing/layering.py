"""The column of each node and hub: arrows point to the right unless they belong to a cycle.

Cycles are opened at few wires (the greedy heuristic of Eades, Lin and Smyth). Then each vertex moves as far
left as its sources allow, and a vertex with as many targets as sources or more moves right again, next to its
targets. Nodes are in even columns and hubs in odd ones, since every wire joins one of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.wiring import Flow

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.tools.graph_drawing.wiring import Wiring

_PULLS: Final = 4
"""Rounds of moving right: a vertex that moves makes space for its sources."""

Neighbours = list[list[int]]


def layers_of(wiring: Wiring) -> list[int]:
    """Return the column of each node and, after them, of each hub.

    Args:
        wiring: The nodes, hubs and wires.

    Returns:
        Column numbers; the first column is 0.
    """
    nodes = len(wiring.nodes)
    count = nodes + len(wiring.hubs)
    arrows = [
        (node, nodes + hub) if flow & Flow.TO_HUB else (nodes + hub, node)
        for (node, hub), flow in sorted(wiring.wires.items())
    ]
    order = _sequence(*_neighbours(count, arrows))
    rank = {vertex: at for at, vertex in enumerate(order)}
    forward = [(min(ends, key=rank.__getitem__), max(ends, key=rank.__getitem__)) for ends in arrows]
    ahead, behind = _neighbours(count, forward)
    column = [int(vertex >= nodes) for vertex in range(count)]
    for vertex in order:
        for other in behind[vertex]:
            column[vertex] = max(column[vertex], column[other] + 1)
    for _ in range(_PULLS):
        for vertex in reversed(order):
            if ahead[vertex] and len(ahead[vertex]) >= len(behind[vertex]):
                column[vertex] = min(column[other] for other in ahead[vertex]) - 1
    first = min(column, default=0)
    return [each - first for each in column]


def folded(columns: list[int], last: int | None) -> list[int]:
    """Return the columns, folded back and forth so that none is beyond the last one.

    Args:
        columns: The column of each vertex. Neighbouring columns stay neighbours.
        last: The last column, 1 or more; None to fold nothing.
    """
    if last is None:
        return columns
    return [last - abs(last - each % (2 * last)) for each in columns]


def folds(
    columns: list[int], widths: list[float], *, between: float, max_width: float, fewest: int
) -> Iterator[int]:
    """Yield the last columns for which a drawing may fit a width, the largest first, without a layout.

    Args:
        columns: The column of each node and hub.
        widths: The width of each node and hub.
        between: The least width between columns.
        max_width: The width of the whole drawing.
        fewest: The fewest columns to fold to.
    """
    most = max(columns)
    for last in range(most, min(most, fewest - 1) - 1, -1):
        widest = [0.0] * (last + 1)
        for column, width in zip(folded(columns, last), widths, strict=True):
            widest[column] = max(widest[column], width)
        if sum(widest) + between * last <= max_width:
            yield last


def _neighbours(count: int, arrows: Iterable[tuple[int, int]]) -> tuple[Neighbours, Neighbours]:
    """Return the targets and the sources of each of `count` vertices."""
    ahead: Neighbours = [[] for _ in range(count)]
    behind: Neighbours = [[] for _ in range(count)]
    for source, target in arrows:
        ahead[source].append(target)
        behind[target].append(source)
    return ahead, behind


def _sequence(ahead: Neighbours, behind: Neighbours) -> list[int]:
    """Return the vertices in an order that few arrows contradict."""
    left = dict.fromkeys(range(len(ahead)))
    outs, ins = [len(each) for each in ahead], [len(each) for each in behind]
    first: list[int] = []
    last: list[int] = []

    def move(vertex: int, onto: list[int]) -> None:
        del left[vertex]
        onto.append(vertex)
        for other in ahead[vertex]:
            ins[other] -= 1
        for other in behind[vertex]:
            outs[other] -= 1

    while left:
        sinks = [vertex for vertex in left if not outs[vertex]]
        sources = [vertex for vertex in left if not ins[vertex]]
        if sinks:
            move(sinks[-1], last)
        elif sources:
            move(sources[0], first)
        else:
            move(max(left, key=lambda vertex: (outs[vertex] - ins[vertex], -vertex)), first)
    return first + last[::-1]
