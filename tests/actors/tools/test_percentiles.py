"""Percentiles over a sliding window."""

from __future__ import annotations

import pytest

from actors.tools.percentiles import Percentiles


def test_of_nothing_nothing_is_known() -> None:
    """No values, no percentile."""
    assert Percentiles().at(0.99) is None


@pytest.mark.parametrize(("part", "value"), [(0.005, 1), (0.07, 7), (0.5, 50), (0.99, 99), (1, 100)])
def test_the_nearest_rank(part: float, value: int) -> None:
    """Of 1 to 100, in any order, p50 is 50 and p99 is 99."""
    values = Percentiles()
    for number in (*range(100, 50, -1), *range(1, 51)):
        values.add(number)
    assert values.at(part) == value


def test_old_values_leave() -> None:
    """Only the newest of the window's size count."""
    values = Percentiles(window=3)
    for number in (9, 9, 9, 1, 2, 3):
        values.add(number)
    assert (len(values), values.at(1)) == (3, 3)


@pytest.mark.parametrize("part", [0, 1.01, -1])
def test_a_part_is_a_part(part: float) -> None:
    """Percent, taken for parts, are an error."""
    with pytest.raises(ValueError, match="above 0"):
        Percentiles().at(part)
