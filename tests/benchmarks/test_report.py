"""The page that the suite writes."""

from __future__ import annotations

import pytest

from benchmarks import report
from benchmarks.harness.results import Entrant, Failure, Results, Sample
from benchmarks.targets import verdicts


def results() -> Results:
    """callboard and a peer, in W1 and W8."""
    rates = [("callboard", 0, 100.0), ("callboard", 1, 300.0), ("peer", 0, 50.0), ("peer", 1, 50.0)]
    samples = [
        Sample(workload="W1", case="16 B", contender=who, repetition=n, figures={"rate": rate, "mb_s": 1.0})
        for who, n, rate in rates
    ]
    samples += [
        Sample(
            workload="W8",
            case=f"topics: {count}",
            contender="callboard",
            repetition=0,
            figures={"cost_us": cost, "rate": 1.0, "cpu_us.broker": 2.5},
        )
        for count, cost in (("1", 2.0), ("1,000", 4.0))
    ]
    return Results(
        machine={"CPU": "abacus"},
        date="2030-01-01T00:00:00+00:00",
        command="python benchmarks/suite.py",
        seconds=1.0,
        repetitions=2,
        entrants=[
            Entrant(name="callboard", version="1", brokered=True),
            Entrant(name="peer", version="2", brokered=True),
        ],
        skipped={"other": "not installed"},
        samples=samples,
        failures=[Failure(workload="W2", case="256 B", contender="peer", repetition=0, reason="fell over")],
    )


PAGE = f"# Title\n\nby hand\n\n{report.BEGIN}\nold\n{report.END}\n\nby hand, too\n"


def test_only_what_is_between_the_markers_changes() -> None:
    """And the same results give the same page, however often."""
    page = report.updated(PAGE, report.body(results()))
    assert page.startswith(f"# Title\n\nby hand\n\n{report.BEGIN}\n")
    assert page.endswith(f"{report.END}\n\nby hand, too\n")
    assert "\nold\n" not in page
    assert report.updated(page, report.body(results())) == page


@pytest.mark.parametrize("page", ["", report.BEGIN, report.END, f"{report.END}{report.BEGIN}"])
def test_a_page_without_its_markers_is_refused(page: str) -> None:
    """Rather than overwritten."""
    with pytest.raises(ValueError, match="markers"):
        report.updated(page, report.body(results()))


def test_figures_stand_with_their_spread_and_the_ratio() -> None:
    """callboard's median is four times the peer's."""
    page = report.updated(PAGE, report.body(results()))
    assert "| **callboard** | 200 (100 to 300) | 1.0 | 1.00 |" in page
    assert "| peer | 50.0 | 1.0 | 4.00 |" in page
    assert "| W1 16 B | **4.00** |" in page


def test_users_get_the_main_figures_first_and_developers_the_targets() -> None:
    """The page for users has no targets, and the one for developers nothing else."""
    page = report.body(results())
    assert page.startswith("### In short\n\n|  |  | callboard |\n")
    assert "| one publisher, one subscriber, KEEP_ALL, nothing lost | 16 B | 200 msg/s |" in page
    assert "reached" not in page
    assert "| W8 topics | 1,000 cost at most 1.5 x what 1 costs, for each message | 2.00 x | **no** |" in (
        report.targets(results())
    )


def test_curves_are_compared_with_their_first_point() -> None:
    """1,000 topics cost twice what one costs."""
    assert "| topics: 1,000 | 4.0 | 1.0 | 2.50 | 2.0 |" in report.updated(PAGE, report.body(results()))


def test_who_was_skipped_and_what_failed_is_reported() -> None:
    """With the reason."""
    page = report.updated(PAGE, report.body(results()))
    assert "Skipped: other: not installed." in page
    assert "Failed: W2 256 B, peer: fell over." in page


def test_targets_are_judged() -> None:
    """One is reached, one is not: four times the peer is enough, twice the cost is too much."""
    assert [(each.what, each.found, each.reached) for each in verdicts(results())] == [
        ("W1 16 B", "4.00 x peer", True),
        ("W8 topics", "2.00 x", False),
    ]


def test_a_target_is_judged_by_the_best_peer_that_it_names() -> None:
    """Shared memory does not count where the work is to go through a socket; nats-py is judged by itself."""
    found = results()
    names = {"nats-py": True, "direct": False, "router, shared memory": True, "router": True}
    found.entrants += [Entrant(name=name, version="1", brokered=brokered) for name, brokered in names.items()]
    for case in ("16 B", "4 KiB"):
        for name, rate in {"callboard": 200.0, "nats-py": 40.0, "direct": 190.0, "router": 100.0}.items():
            figures = {"rate": rate, "mb_s": 1.0}
            found.samples.append(
                Sample(workload="W1", case=case, contender=name, repetition=2, figures=figures)
            )
    found.samples.append(
        Sample(
            workload="W1",
            case="4 KiB",
            contender="router, shared memory",
            repetition=0,
            figures={"rate": 900.0, "mb_s": 1.0},
        )
    )
    judged = [(each.what, each.found, each.reached) for each in verdicts(found) if each.what.startswith("W1")]
    assert judged == [
        ("W1 16 B", "1.05 x direct", False),
        ("W1 16 B", "5.00 x nats-py", False),
        ("W1 4 KiB", "2.00 x router", True),
    ]
