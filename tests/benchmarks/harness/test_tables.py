"""What people read: tables of figures, and the bar while they wait."""

from __future__ import annotations

import pytest

from actors.cli.bench.results import number
from benchmarks.harness.progress import line
from benchmarks.harness.results import Spread
from benchmarks.harness.runner import Progress
from benchmarks.harness.tables import aligned, shown


@pytest.mark.parametrize(
    ("value", "text"),
    [(1234567.8, "1,234,568"), (123.4, "123"), (12.34, "12.3"), (1.234, "1.23"), (0.0, "0.0")],
)
def test_numbers_have_three_digits(value: float, text: str) -> None:
    """More would say nothing."""
    assert number(value) == text


def test_a_figure_shows_its_spread() -> None:
    """If there is one."""
    assert shown(Spread(200.0, 100.0, 300.0)) == "200 (100 to 300)"
    assert shown(Spread(200.0, 200.0, 200.0)) == "200"
    assert shown(None) == "-"


def test_columns_are_aligned() -> None:
    """Names to the left, figures to the right."""
    assert aligned([["", "a"], ["long", "12"]]) == ["       a", "long  12"]


def test_the_bar_is_as_full_as_the_work_is_done() -> None:
    """From empty to full."""
    assert line(Progress(0.0, 1.0, "")).count("#") == 0
    assert line(Progress(1.0, 0.0, "")).count("-") == 0
