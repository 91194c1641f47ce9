"""The picture that the suite draws, where matplotlib is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from benchmarks import plot
from benchmarks.harness.results import Entrant, Results, Sample
from benchmarks.harness.workloads import WORKLOADS

if TYPE_CHECKING:
    from pathlib import Path


def results(*samples: Sample) -> Results:
    """A run of two contenders."""
    return Results(
        machine={},
        date="",
        command="",
        seconds=1.0,
        repetitions=1,
        entrants=[Entrant(name=name, version="1", brokered=True) for name in ("callboard", "peer")],
        samples=list(samples),
    )


def test_every_panel_shows_a_case_that_there_is() -> None:
    """By workload, case and figure."""
    figures = {
        (workload.id, case.name, figure.key)
        for workload in WORKLOADS
        for case in workload.cases
        for figure in workload.figures
    }
    assert {(panel.workload, panel.case, panel.key) for panel in plot.PANELS} <= figures


def test_the_same_results_are_the_same_plot(tmp_path: Path) -> None:
    """Byte for byte, so that a commit shows what has changed."""
    pytest.importorskip("matplotlib")
    samples = [
        Sample(workload="W1", case="256 B", contender=name, repetition=0, figures={"rate": 5e5})
        for name in ("callboard", "peer")
    ]
    paths = [tmp_path / "a.svg", tmp_path / "b.svg"]
    for path in paths:
        plot.draw(results(*samples), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert b"<svg" in paths[0].read_bytes()
