"""The order of things in their columns."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from actors.tools.graph_drawing.ordering import ordered

LINES = st.lists(st.tuples(st.integers(0, 6), st.integers(7, 13)), unique=True, max_size=20)


def crossings(columns: list[list[int]], lines: list[tuple[int, int]]) -> int:
    """Count pairs of lines that cross."""
    place = {item: at for column in columns for at, item in enumerate(column)}
    return sum(
        (place[a] - place[c]) * (place[b] - place[d]) < 0
        for at, (a, b) in enumerate(lines)
        for c, d in lines[at + 1 :]
    )


def test_lines_are_untangled() -> None:
    """What can be drawn without a crossing is."""
    lines = [(0, 12), (1, 11), (2, 10), (10, 22), (11, 21), (12, 20)]
    columns = ordered([[0, 1, 2], [10, 11, 12], [20, 21, 22]], lines)
    assert crossings(columns, lines) == 0


@given(LINES)
def test_it_never_becomes_worse(lines: list[tuple[int, int]]) -> None:
    """Each column keeps its items, and no more lines cross than before."""
    before = [list(range(7)), list(range(7, 14))]
    after = ordered(before, lines)
    assert [sorted(column) for column in after] == before
    assert crossings(after, lines) <= crossings(before, lines)
