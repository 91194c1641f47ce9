"""Statistics over samples."""

from __future__ import annotations

import msgspec
import pytest

from benchmarks.harness.results import Entrant, Results, Sample, Spread, advantage, spread


def results(*samples: Sample) -> Results:
    """Results of a run that had these samples."""
    return Results(
        machine={"CPU": "abacus"},
        date="2030-01-01T00:00:00+00:00",
        command="bench",
        seconds=1.0,
        repetitions=3,
        entrants=[Entrant(name="callboard", version="1", brokered=True)],
        samples=list(samples),
    )


def sample(repetition: int, contender: str = "callboard", **figures: float) -> Sample:
    """One trial of W1."""
    return Sample(workload="W1", case="16 B", contender=contender, repetition=repetition, figures=figures)


def test_the_spread_is_median_least_and_most() -> None:
    """In whatever order the values come; of an even number the median lies between."""
    assert spread([3.0, 1.0, 2.0]) == Spread(2.0, 1.0, 3.0)
    assert spread([4.0, 2.0]) == Spread(3.0, 2.0, 4.0)
    assert spread([5.0]) == Spread(5.0, 5.0, 5.0)


def test_figures_are_one_contenders_in_one_case() -> None:
    """Other contenders and cases are not mixed in; a repetition may lack a figure."""
    found = results(
        sample(0, rate=10.0, mb_s=1.0),
        sample(1, rate=30.0),
        sample(2, rate=20.0),
        sample(0, "peer", rate=99.0),
    )
    assert found.figures("W1", "16 B", "callboard") == {
        "rate": Spread(20.0, 10.0, 30.0),
        "mb_s": Spread(1.0, 1.0, 1.0),
    }
    assert found.figures("W1", "1 MiB", "callboard") == {}


@pytest.mark.parametrize(
    ("own", "other", "more", "ratio"),
    [(20.0, 10.0, True, 2.0), (20.0, 10.0, False, 0.5), (10.0, 20.0, False, 2.0)],
)
def test_an_advantage_is_above_one_where_it_is_one(
    own: float, other: float, more: bool, ratio: float
) -> None:
    """Twice the rate is 2, and so is half the delay."""
    assert advantage(own, other, more_is_better=more) == ratio


def test_results_survive_json() -> None:
    """What is written has the medians in it, and can be read again."""
    written = results(sample(0, rate=10.0), sample(1, rate=20.0))
    document = written.document()
    (median,) = document["medians"]
    assert median["contender"] == "callboard"
    assert median["figures"] == {"rate": {"median": 15.0, "least": 10.0, "most": 20.0}}
    assert msgspec.json.decode(msgspec.json.encode(document), type=Results) == written
