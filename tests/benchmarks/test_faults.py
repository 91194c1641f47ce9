"""The resilience script: its arithmetic and its judgements."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import msgspec
import pytest

from benchmarks import resilience
from benchmarks.faults import churn, freeze, page, presence, restart
from benchmarks.faults.figures import Section, milliseconds, peak, slope


def a_restart(**totals: int) -> restart.Results:
    """Return a restart of two nodes with these totals."""
    one = restart.Restart(
        pause=0.5, failed=[0.01, 0.03], received=[0.2, 0.9], answered=[0.3, 0.4], attempts=[0.1, 0.15, 0.7]
    )
    return restart.Results(
        plan=restart.Plan(nodes=2, processes=1, pauses_s=[0.5]),
        restarts=[one],
        totals=Counter(published=100, received=90, lost_on_break=10) + Counter(totals),
        before=Counter(tasks=9, files=20, memory_kib=1024),
        after=Counter(tasks=9, files=20, memory_kib=2048),
    )


def samples(kib_per_life: float, *, files_left: int = 0) -> list[dict[str, Any]]:
    """Return samples of a thousand lives."""
    return [
        {
            "lives": lives,
            "memory_kib": {"broker": 20_000.0, "nodes": 20_000.0 + kib_per_life * lives},
            "files": {"broker": 10, "nodes": 10 + (files_left if lives else 0)},
        }
        for lives in range(0, 1001, 100)
    ]


def test_times_are_summarized_in_ms() -> None:
    """The median, the 95th percentile and the maximum, in any order of times."""
    found = milliseconds([0.004, 0.001, 0.002, 0.003, 0.100])
    assert found == {"p50_ms": 3.0, "p95_ms": 100.0, "max_ms": 100.0, "count": 5}


def test_the_peak_is_found_wherever_its_window_begins() -> None:
    """The most events in any window, whose end is excluded."""
    assert peak([0.95, 1.0, 1.04, 2.0], 0.1) == 3
    assert peak([0.0, 0.5, 1.0], 0.5) == 1
    assert peak([], 0.1) == 0


def test_the_slope_is_that_of_the_least_squares_line() -> None:
    """It is exact on a line, and 0 if all x are equal."""
    assert slope([(0, 5), (10, 25), (20, 45)]) == pytest.approx(2.0)
    assert slope([(3, 1), (3, 9)]) == 0.0


def test_a_node_is_back_after_its_first_message_and_reply() -> None:
    """The later of the two counts; the table has a row per restart."""
    found = restart.section(a_restart())
    assert found.failures == []
    assert found.rows == [["0.5 s", "20 / 30 ms", "0.60 s", "0.90 s", "3", "2"]]
    assert found.figures["restarts"][0]["back"]["max_ms"] == pytest.approx(900)


@pytest.mark.parametrize("what", ["unaccounted", "duplicates", "hung"])
def test_a_broken_promise_is_a_failure(what: str) -> None:
    """Unaccounted messages, duplicates and hanging calls are reported."""
    (failure,) = restart.section(a_restart(**{what: 3})).failures
    assert failure.startswith("3 ")


def test_files_left_open_are_a_failure() -> None:
    """One descriptor more than before is reported."""
    found = a_restart()
    found.after["files"] += 1
    assert restart.section(found).failures == ["1 files were left open"]


@pytest.mark.parametrize(
    ("errors", "failures"),
    [
        ([0.001, 0.050, 0.250], []),
        ([0.001, 0.051, 0.052], ["p50"]),
        ([0.001, 0.002, 0.251], ["max"]),
        ([0.3], ["p50", "max"]),
    ],
)
def test_a_death_noticed_late_is_a_failure(errors: list[float], failures: list[str]) -> None:
    """Median and maximum are judged, idle and busy."""
    for load in ("idle", "busy"):
        found = presence.presence_section({load: presence.Rounds(errors=errors)}).failures
        assert [re.findall(rf"{load}: .* \((\w+)\)", failure)[0] for failure in found] == failures


@pytest.mark.parametrize(("kib_per_life", "files_left", "failures"), [(0.1, 0, 0), (1.0, 0, 1), (0.1, 2, 1)])
def test_growth_is_a_failure(kib_per_life: float, files_left: int, failures: int) -> None:
    """Growing memory and files left open are reported."""
    points = samples(kib_per_life, files_left=files_left)
    found = churn.section(churn.Results(lives=1000, resets=7, seconds=9, samples=points))
    assert len(found.failures) == failures
    assert [row[0] for row in found.rows] == ["broker", "nodes"]


def test_the_page_keeps_its_text_around_the_markers() -> None:
    """New tables replace the old ones; sections that were not measured again stay."""
    section = Section(
        key="k", title="new title", text="How.", heading=["a", "b"], rows=[["1", "2"]], figures={}
    )
    older = Section(
        key="old", title="old", text="", heading=["c"], rows=[], figures={}, failures=["it leaks"]
    )
    report = page.Report(machine={"CPU": "abacus"}, date="2030-01-01", sections={"k": section})
    before = page.Report(machine={}, date="2029-01-01", sections={"k": older, "old": older})
    text = page.update_page(f"head\n{page.BEGIN}\nstale\n{page.END}\ntail", report.merged_with(before))
    assert text.startswith("head\n")
    assert text.endswith("\ntail")
    assert "stale" not in text
    assert "### New title\n\nHow.\n\n| a | b |\n| --- | ---: |\n| 1 | 2 |" in text
    assert "**Not kept:** it leaks." in text
    with pytest.raises(ValueError, match="markers"):
        page.update_page("nothing", report)


def test_every_command_in_the_documents_is_accepted() -> None:
    """The commands of the page and of the script's help can be parsed."""
    assert resilience.__doc__
    text = resilience.PAGE.read_text("utf-8") + resilience.__doc__
    shown = re.findall(r"^    python benchmarks/resilience.py(.*?)(?:   .*)?$", text, re.MULTILINE)
    assert len(shown) >= 6
    for arguments in shown:
        assert resilience.parse(arguments.split()).what in {*resilience.MEASUREMENTS, "all"}


def test_the_page_matches_the_results() -> None:
    """Its figures are those of docs/resilience.json, with every measurement."""
    report = msgspec.json.decode(resilience.JSON.read_bytes(), type=page.Report)
    text = resilience.PAGE.read_text("utf-8")
    assert page.update_page(text, report) == text
    assert {*report.sections} == {*resilience.MEASUREMENTS}


def test_a_late_suspension_is_a_failure() -> None:
    """Beyond the keepalive limit and what a check takes."""
    late = freeze.Rounds(keepalive_s=0.3, errors=[0.7], returns=[0.001])
    assert len(freeze.section([late]).failures) == 1
