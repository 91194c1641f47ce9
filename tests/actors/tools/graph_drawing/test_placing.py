"""Heights of a column's things."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.tools.graph_drawing.placing import Wish, placed

WISHES = st.lists(
    st.builds(Wish, st.floats(-100, 100), st.floats(0.01, 100), st.integers(1, 9).map(float)), max_size=12
)


def test_wishes_come_true_where_there_is_room() -> None:
    """Nothing moves that need not."""
    assert placed([Wish(0, 1, 3), Wish(5, 1, 3), Wish(8, 1, 3)], whole=False) == [0, 5, 8]


def test_those_who_want_one_place_share_the_disappointment() -> None:
    """By their weights."""
    assert placed([Wish(0, 1, 4), Wish(0, 1, 4)], whole=False) == [-2, 2]
    assert placed([Wish(0, 3, 4), Wish(0, 1, 4)], whole=False) == [-1, 3]


@pytest.mark.parametrize("whole", [False, True])
@given(wishes=WISHES)
def test_nothing_overlaps(whole: bool, wishes: list[Wish]) -> None:
    """Each begins where the one above ends, or below; on whole rows if they are asked for."""
    tops = placed(wishes, whole=whole)
    assert len(tops) == len(wishes)
    for (top, wish), (following, _) in pairwise(zip(tops, wishes, strict=True)):
        assert top + wish.height <= following + 1e-6
    assert not whole or all(top == int(top) for top in tops)
