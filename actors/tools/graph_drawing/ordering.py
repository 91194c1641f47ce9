"""The order of the items in each column, so that few lines cross.

Sweeps to the right and to the left sort each column by the mean position of its neighbours; the order with
the fewest crossings wins.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from itertools import pairwise
from typing import Final

SWEEPS: Final = 12

Neighbours = dict[int, list[int]]
"""The neighbours of each item in the column beside it."""


def ordered(columns: list[list[int]], lines: list[tuple[int, int]]) -> list[list[int]]:
    """Return the columns, each sorted so that few lines cross.

    Args:
        columns: The items of each column; their order decides between equal positions.
        lines: Pairs of an item and one in the next column.
    """
    to_left: Neighbours = {item: [] for column in columns for item in column}
    to_right: Neighbours = {item: [] for column in columns for item in column}
    for left, right in lines:
        to_right[left].append(right)
        to_left[right].append(left)
    best = current = [list(column) for column in columns]
    fewest = _crossings(best, to_right)
    for sweep in range(SWEEPS):
        current = _swept(current, to_left, to_right, rightward=sweep % 2 == 0)
        count = _crossings(current, to_right)
        if count < fewest:
            best, fewest = current, count
    return best


def _swept(
    columns: list[list[int]], to_left: Neighbours, to_right: Neighbours, *, rightward: bool
) -> list[list[int]]:
    """Return the columns, each sorted by its neighbours' positions in the column before it in the sweep."""
    result = [list(column) for column in columns]
    beside = to_left if rightward else to_right
    numbers = range(1, len(result)) if rightward else range(len(result) - 2, -1, -1)
    for number in numbers:
        before = result[number - 1 if rightward else number + 1]
        place = {item: at / max(1, len(before)) for at, item in enumerate(before)}
        column = result[number]
        own = {item: at / len(column) for at, item in enumerate(column)}
        wanted = {
            item: sum(place[other] for other in beside[item]) / len(beside[item])
            if beside[item]
            else own[item]
            for item in column
        }
        column.sort(key=wanted.__getitem__)
    return result


def _crossings(columns: list[list[int]], to_right: Neighbours) -> int:
    count = 0
    for column, following in pairwise(columns):
        place = {item: at for at, item in enumerate(following)}
        ends: list[int] = []
        for item in column:
            reached = sorted(place[other] for other in to_right[item])
            count += sum(len(ends) - bisect_right(ends, end) for end in reached)
            for end in reached:
                insort(ends, end)
    return count
