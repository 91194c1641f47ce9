"""`callboard bench`: what it is asked, and what it answers, without measuring."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from actors.bench import alone
from actors.bench.results import Entrant, Failure, Results, Sample
from actors.cli.main import main

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.bench.workloads import Workload


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the measurement is asked; it fails in W3 and gives 1,000 in W4."""
    received: dict[str, Any] = {}

    async def measure(workloads: Sequence[Workload], **options: Any) -> Results:
        received.update(
            options, cases=[f"{each.id} {case.name}" for each in workloads for case in each.cases]
        )
        results = Results(
            machine={},
            date="",
            command="",
            seconds=options["seconds"],
            repetitions=options["repetitions"],
            entrants=[Entrant(name="callboard", version="1", brokered=True)],
        )
        where = {"contender": "callboard", "repetition": 0}
        results.samples.append(
            Sample(workload="W4", case="100 in flight", figures={"rate": 1000.0}, **where)  # type: ignore[arg-type]
        )
        if "W3 1 in flight" in received["cases"]:
            failure = Failure(workload="W3", case="1 in flight", reason="server ended with 1", **where)  # type: ignore[arg-type]
            results.failures.append(failure)
        return results

    monkeypatch.setattr(alone, "measure", measure)
    return received


def test_options_reach_the_measurement(asked: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    """In any case, and the table comes out."""
    arguments = ["w4", "--seconds", "2", "--repetitions", "5", "--loop", "asyncio", "--transport", "tcp"]
    arguments += ["--rules", "1000"]
    assert main(["bench", *arguments]) == 0
    assert asked["cases"] == ["W4 100 in flight"]
    assert (asked["seconds"], asked["repetitions"]) == (2.0, 5)
    assert (asked["loop"], asked["transport"], asked["rules"]) == ("asyncio", "tcp", 1000)
    assert "100 in flight  1,000" in capsys.readouterr().out


def test_without_a_choice_what_takes_long_is_left_out(asked: dict[str, Any]) -> None:
    """Every workload is there, 10,000 connections are not."""
    assert main(["bench"]) == 1
    assert {case.split()[0] for case in asked["cases"]} == {f"W{n}" for n in range(1, 11)}
    assert "W5 10,000" not in asked["cases"]


def test_a_failed_trial_is_exit_code_1(asked: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    """And said on stderr; the JSON on stdout has it, too."""
    assert main(["bench", "W3", "W4", "--json"]) == 1
    streams = capsys.readouterr()
    assert streams.err == "W3 1 in flight failed: server ended with 1\n"
    document = json.loads(streams.out)
    assert document["failures"][0]["reason"] == "server ended with 1"
    assert document["medians"][0]["figures"]["rate"]["median"] == 1000.0


@pytest.mark.parametrize("wrong", [["W99"], ["--seconds", "0"], ["--repetitions", "0"], ["--loop", "select"]])
def test_wrong_usage_is_exit_code_2(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """In one line."""
    assert main(["bench", *wrong]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
