"""In which order things stand in their columns: so that few lines cross.

Sweeps to the right and to the left sort each column by where its neighbours are on average; then neighbours
change places as long as that takes crossings away.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from itertools import pairwise
from typing import Final

SWEEPS: Final = 12
SWAP_ROUNDS: Final = 4
MAX_SWAPPED: Final = 60
"""Columns with more in them are not improved by swapping: that takes the square of the time."""

Neighbours = dict[int, list[int]]
"""Of each item, those in the column beside it."""


def ordered(columns: list[list[int]], lines: list[tuple[int, int]]) -> list[list[int]]:
    """Return the columns sorted so that few lines cross.

    Args:
        columns: The items of each column, in the order that decides when all else is equal.
        lines: Each from an item to one in the next column.
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
    return _swapped(best, to_left, to_right)


def _swept(
    columns: list[list[int]], to_left: Neighbours, to_right: Neighbours, *, rightward: bool
) -> list[list[int]]:
    """Return the columns, each sorted by the places of its neighbours in the one before, in one direction."""
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


def _swapped(columns: list[list[int]], to_left: Neighbours, to_right: Neighbours) -> list[list[int]]:
    place = {item: at for column in columns for at, item in enumerate(column)}

    def saved(upper: int, lower: int) -> int:
        """Return how many crossings fewer there are when the two change places."""
        return sum(
            _inversions(beside[upper], beside[lower], place)
            - _inversions(beside[lower], beside[upper], place)
            for beside in (to_left, to_right)
        )

    for _ in range(SWAP_ROUNDS):
        changed = False
        for column in columns:
            if len(column) > MAX_SWAPPED:
                continue
            for at in range(len(column) - 1):
                upper, lower = column[at], column[at + 1]
                if saved(upper, lower) > 0:
                    column[at], column[at + 1] = lower, upper
                    place[upper], place[lower] = at + 1, at
                    changed = True
        if not changed:
            break
    return columns


def _inversions(upper: list[int], lower: list[int], place: dict[int, int]) -> int:
    """Return how many pairs of lines cross, of an item's and those of the item below it."""
    ends = sorted(place[item] for item in lower)
    return sum(bisect_right(ends, place[item] - 1) for item in upper)
