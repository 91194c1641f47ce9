"""What people read: tables of figures, and the bar while they wait."""

from __future__ import annotations

import io

import pytest

from actors.bench.progress import ProgressBar, line
from actors.bench.results import Entrant, Results, Sample, Spread
from actors.bench.runner import Progress
from actors.bench.tables import aligned, number, report, shown
from actors.bench.workloads import WORKLOADS


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


def test_a_report_has_what_was_measured_and_nothing_else() -> None:
    """A heading for each workload with figures, then its cases, then CPU by role."""
    sample = Sample(
        workload="W4",
        case="100 in flight",
        contender="callboard",
        repetition=0,
        figures={"rate": 1000.0, "cpu_us.server": 5.0},
    )
    results = Results(
        machine={},
        date="",
        command="",
        seconds=1.0,
        repetitions=1,
        entrants=[Entrant(name="callboard", version="1", brokered=True)],
        samples=[sample],
    )
    heading, columns, row = report(results, WORKLOADS, "callboard")
    assert heading.startswith("W4  add_two_ints, 100")
    assert columns.split() == ["req/s", "server", "us", "CPU"]
    assert row.split() == ["100", "in", "flight", "1,000", "5.0"]


class Terminal(io.StringIO):
    """A stream that says it is one."""

    def isatty(self) -> bool:
        return True


def test_the_bar_is_gone_in_the_end() -> None:
    """Each drawing starts at the line's begin, and the last one is empty."""
    stream = Terminal()
    with ProgressBar(stream) as bar:
        bar.draw(Progress(0.5, 65.0, "W1"))
    assert "1:05 left  W1" in stream.getvalue()
    assert stream.getvalue().endswith("\r\x1b[K")


def test_no_bar_where_there_is_no_terminal() -> None:
    """A log file gets nothing."""
    stream = io.StringIO()
    with ProgressBar(stream) as bar:
        bar.draw(Progress(0.5, 65.0, "W1"))
    assert stream.getvalue() == ""


def test_the_bar_is_as_full_as_the_work_is_done() -> None:
    """From empty to full."""
    assert line(Progress(0.0, 1.0, "")).count("#") == 0
    assert line(Progress(1.0, 0.0, "")).count("-") == 0
