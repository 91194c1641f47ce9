"""`callboard bench`: what it measures, and what it prints, without measuring."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.bench import results
from actors.cli.errors import CommandError
from actors.cli.main import main

if TYPE_CHECKING:
    from actors.cli.bench.setup import Setup
    from actors.cli.bench.trial import Case


@pytest.fixture
def trials(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, float]]:
    """The trials that were run: case, setup and seconds; W3 fails, and others give 1,000, 2,000 and so on."""
    done: list[tuple[str, str, float]] = []

    async def run_trial(setup: Setup, case: Case, seconds: float) -> dict[str, float]:
        done.append((case.name, str(setup), seconds))
        if case.name == "1 in flight":
            raise CommandError("server ended with 1")
        return {"rate": 1000.0 * len(done), "cpu_us.server": 5.0}

    monkeypatch.setattr(results, "run_trial", run_trial)
    return done


def test_options_reach_the_measurement(
    trials: list[tuple[str, str, float]], capsys: pytest.CaptureFixture[str]
) -> None:
    """A workload's name in any case; the table has medians, spreads and the CPU time of the roles."""
    arguments = ["w4", "--seconds", "2", "--repetitions", "3", "--loop", "asyncio", "--transport", "tcp"]
    arguments += ["--rules", "1000"]
    assert main(["bench", *arguments]) == 0
    assert trials == [("100 in flight", "callboard (asyncio, tcp, 1,000 rules)", 2.0)] * 3
    heading, columns, row = capsys.readouterr().out.splitlines()
    assert heading == "W4  add_two_ints, 100 calls in flight"
    assert columns.split() == ["req/s", "server", "us", "CPU"]
    assert row.split() == ["100", "in", "flight", "2,000", "(1,000", "to", "3,000)", "5.0"]


def test_without_a_choice_what_takes_long_is_left_out(trials: list[tuple[str, str, float]]) -> None:
    """Every workload is measured, messages of 8 MiB are not; repetitions are outermost."""
    assert main(["bench", "--repetitions", "2"]) == 1
    names = [name for name, _, _ in trials]
    assert names[:7] == ["16 B", "256 B", "4 KiB", "64 KiB", "1 MiB", "1 in flight", "100 in flight"]
    assert names == names[:7] * 2


@pytest.mark.usefixtures("trials")
def test_a_failed_trial_is_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    """And said on stderr; the JSON on stdout has it, too."""
    assert main(["bench", "W3", "W4", "--json", "--repetitions", "1"]) == 1
    streams = capsys.readouterr()
    assert streams.err == "W3 1 in flight failed: server ended with 1\n"
    document: dict[str, Any] = json.loads(streams.out)
    assert document["failures"][0]["reason"] == "server ended with 1"
    assert document["medians"][0]["figures"]["rate"] == {"median": 2000.0, "least": 2000.0, "most": 2000.0}


@pytest.mark.usefixtures("trials")
def test_a_terminal_shows_which_trial_runs(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one line, which is cleared in the end."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(["bench", "W4", "--repetitions", "2"]) == 0
    shown = capsys.readouterr().err.split("\r\x1b[K")
    assert shown == ["", *(f"{done} of 2 trials done: W4 100 in flight" for done in range(2)), ""]


def test_workloads_of_a_checkout_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    """The error says in one line how to run one that is not installed."""
    assert main(["bench", "w7"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "W7 is not installed; run it in a checkout" in line
    assert "python benchmarks/suite.py W7 --peers ''" in line


@pytest.mark.parametrize("wrong", [["W99"], ["--seconds", "0"], ["--repetitions", "0"], ["--loop", "select"]])
def test_wrong_usage_is_exit_code_2(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """In one line."""
    assert main(["bench", *wrong]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
