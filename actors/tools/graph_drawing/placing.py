"""The heights of the things in a column: near their neighbours, in order, and without overlap.

Isotonic regression, by pooling neighbours that push each other, minimises the weighted distance to the
heights that the things ask for.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Wish(NamedTuple):
    """The position that one thing of a column asks for.

    Attributes:
        top: Where it should begin.
        weight: How much that matters.
        height: Its height, with the gap below it.
    """

    top: float
    weight: float
    height: float


def placed(wishes: list[Wish], *, whole: bool) -> list[float]:
    """Return the tops of a column's things, from top to bottom, so that none overlap.

    Args:
        wishes: The positions asked for, in the column's order.
        whole: Return whole numbers; the heights are whole, too.
    """
    blocks: list[tuple[Wish, int]] = []  # things that push each other as one wish, and their number
    for wish in wishes:
        block, count = wish, 1
        while blocks and blocks[-1][0].top + blocks[-1][0].height > block.top:
            above, more = blocks.pop()
            block, count = _pooled(above, block), count + more
        blocks.append((block, count))
    tops: list[float] = []
    things = iter(wishes)
    for block, count in blocks:
        at = float(math.floor(block.top + 0.5)) if whole else block.top
        for _ in range(count):
            tops.append(at)
            at += next(things).height
    return tops


def _pooled(above: Wish, below: Wish) -> Wish:
    weight = above.weight + below.weight
    top = (above.top * above.weight + (below.top - above.height) * below.weight) / weight
    return Wish(top, weight, above.height + below.height)
