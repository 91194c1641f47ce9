"""How high things stand in their columns: near what they are joined to, in order, and never one on another.

Each column in turn gets the heights that are least far from what its items want (isotonic regression, by
pooling neighbours that push each other).
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Wish(NamedTuple):
    """What one thing of a column wants: its top, how much that matters, and its height with its gap."""

    top: float
    weight: float
    height: float


def placed(wishes: list[Wish], *, whole: bool) -> list[float]:
    """Return the tops of a column's things, from above to below, so that none overlap.

    Args:
        wishes: Of each thing, in the column's order.
        whole: Heights are whole numbers, and tops are to be.
    """
    blocks: list[tuple[Wish, int]] = []  # things that push each other, as one wish, and how many they are
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
