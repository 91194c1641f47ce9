"""The soak counts histories and reports broken promises, hangs and crashes."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING

from tests.simulation import soak
from tests.simulation.breakages import live_with_a_breakage
from tests.simulation.histories import History
from tests.simulation.soak import Plan, Soak

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def live_or_not(seed: int, *, calm: bool) -> History:
    """Histories of which some hang, and some take their process with them."""
    if seed == 1 and calm:
        while True:
            pass
    if seed == 2 and calm:
        os._exit(3)
    return History(seconds=10.0, checks=2, struck={"drop": 1}, wrong="" if seed else "seed 0: it is wrong")


def ignore(text: str) -> None:
    """Print nothing."""


def test_histories_that_hang_or_kill_their_process_are_violations() -> None:
    """They are reported like broken promises, and the other histories continue."""
    lines: list[str] = []
    plan = Plan(seeds=4, processes=2, hang_sec=0.5)
    tally = Soak(plan, live_or_not, lines.append).run()
    assert {(each["seed"], each["kind"]) for each in tally.violations} == {
        (0, "calm"),
        (0, "troubled"),
        (1, "calm"),
        (2, "calm"),
    }
    assert (tally.histories, tally.simulated_s, tally.struck["drop"], tally.next_seed) == (6, 60.0, 6, 4)
    assert any("more than 0.5 s" in line for line in lines)
    assert any("ended with 3" in line for line in lines)


def test_a_broken_promise_is_reported_with_the_command_that_shows_it() -> None:
    """The report of a violation has the command that reproduces it."""
    tally = Soak(Plan(seeds=1, processes=1), live_with_a_breakage, ignore).run()
    again = "python -m pytest tests/simulation/test_histories.py -k calm --first-seed 0 --seeds 1"
    assert tally.violations[0]["replay"] == again
    assert "copies were made" in tally.violations[0]["wrong"]
    assert f"violation: {tally.violations[0]['wrong'].splitlines()[0]}\n  {again}" in tally.summary()


def test_the_command_lives_through_seeds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It exits with 0 when all promises are kept, and writes a report."""
    written = tmp_path / "soak.json"
    assert soak.main(["--first-seed", "2", "--seeds", "1", "--processes", "1", "--json", str(written)]) == 0
    result = json.loads(written.read_text())
    assert (result["histories"], result["next_seed"], result["violations"]) == (2, 3, [])
    assert result["simulated_s"] > 20
    assert result["checks"] > 100
    assert "2 histories before seed 3" in capsys.readouterr().out


def test_a_broken_promise_ends_the_command_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pipeline that runs it notices the violation."""
    violation = {"seed": 0, "kind": "calm", "wrong": "it is", "replay": "again"}
    violated = soak.Tally(0, histories=1, violations=[violation])
    monkeypatch.setattr(Soak, "run", lambda _: violated)
    assert soak.main(["--seeds", "1"]) == 1


def test_a_soak_that_has_lived_through_nothing_ends_with_1() -> None:
    """Without any history nothing has been checked."""
    assert soak.main(["--seeds", "0", "--processes", "1"]) == 1


def test_no_history_begins_after_the_time_is_over() -> None:
    """A soak without time runs nothing."""
    tally = Soak(Plan(minutes=-1.0, processes=1), live_or_not, ignore).run()
    assert (tally.histories, tally.next_seed) == (0, 0)
