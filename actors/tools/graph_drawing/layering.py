"""Which column each node and hub stands in: arrows go to the right wherever no circle forbids it.

Circles are opened at few wires (the greedy heuristic of Eades, Lin and Smyth); then every vertex goes as far
left as its sources allow, and what feeds as much as it is fed by goes right again, to where it is needed.
Nodes stand in even columns and hubs in odd ones, since every wire joins one of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools.graph_drawing.wiring import Flow

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.tools.graph_drawing.wiring import Wiring

_PULLS: Final = 4
"""Rounds of going right again: what is pulled lets those behind it follow."""

Neighbours = list[list[int]]


def layers_of(wiring: Wiring) -> list[int]:
    """Return the column of each node and, after them, of each hub. The first column is 0."""
    ahead, behind = _arrows(wiring)
    place = {vertex: at for at, vertex in enumerate(_sequence(ahead, behind))}
    ahead, behind = _straightened(ahead, place)
    order = sorted(place, key=place.__getitem__)
    column = [int(vertex >= len(wiring.nodes)) for vertex in range(len(ahead))]
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
    """Return the columns with those after the last going back to the left, then on to the right again.

    What stood side by side does so afterwards. `last` is 1 or more.
    """
    if last is None:
        return columns
    return [last - abs(last - each % (2 * last)) for each in columns]


def folds(
    columns: list[int], widths: list[float], *, between: float, room: float, fewest: int
) -> Iterator[int]:
    """Yield the last columns that might do for a width, the largest first, without laying anything out.

    Args:
        columns: Of each node and hub.
        widths: How wide each node and hub is.
        between: The least width between columns.
        room: How wide it all may be.
        fewest: Do not fold to fewer columns.
    """
    most = max(columns)
    for last in range(most, min(most, fewest - 1) - 1, -1):
        widest = [0.0] * (last + 1)
        for column, width in zip(folded(columns, last), widths, strict=True):
            widest[column] = max(widest[column], width)
        if sum(widest) + between * last <= room:
            yield last


def _arrows(wiring: Wiring) -> tuple[Neighbours, Neighbours]:
    """Return what is ahead of each vertex, and what is behind it. A wire with both ways goes to its hub."""
    count = len(wiring.nodes)
    ahead: Neighbours = [[] for _ in range(count + len(wiring.hubs))]
    behind: Neighbours = [[] for _ in ahead]
    for (node, hub), flow in sorted(wiring.wires.items()):
        source, target = (node, count + hub) if flow & Flow.TO_HUB else (count + hub, node)
        ahead[source].append(target)
        behind[target].append(source)
    return ahead, behind


def _straightened(ahead: Neighbours, place: dict[int, int]) -> tuple[Neighbours, Neighbours]:
    """Return the arrows with those turned round that go back in the sequence."""
    forward: Neighbours = [[] for _ in ahead]
    back: Neighbours = [[] for _ in ahead]
    for source, targets in enumerate(ahead):
        for target in targets:
            first, second = sorted((source, target), key=place.__getitem__)
            forward[first].append(second)
            back[second].append(first)
    return forward, back


def _sequence(ahead: Neighbours, behind: Neighbours) -> list[int]:
    """Return the vertices in an order that few arrows go against."""
    left = dict.fromkeys(range(len(ahead)))
    outs, ins = [len(each) for each in ahead], [len(each) for each in behind]
    first: list[int] = []
    last: list[int] = []

    def take(vertex: int, onto: list[int]) -> None:
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
            take(sinks[-1], last)
        elif sources:
            take(sources[0], first)
        else:
            take(max(left, key=lambda vertex: (outs[vertex] - ins[vertex], -vertex)), first)
    return first + last[::-1]
