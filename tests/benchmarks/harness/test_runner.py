"""The order of trials, and what is known about them before and after."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from benchmarks.harness import runner
from benchmarks.harness.contender import Contender
from benchmarks.harness.errors import TrialError
from benchmarks.harness.results import Results
from benchmarks.harness.runner import Progress, lacking, plan, run
from benchmarks.harness.workloads import Case, Part, Workload

if TYPE_CHECKING:
    import pytest

    from benchmarks.harness.outcomes import Outcome


def contender(name: str, *roles: str) -> Contender:
    """Someone who is never started."""
    return Contender(
        name=name,
        version="1",
        brokered=False,
        role_command=(),
        server_command=None,
        server_url=lambda _: "",
        roles=frozenset(roles),
    )


def nothing(_: Outcome) -> dict[str, float]:
    return {}


A, B = contender("a", "player"), contender("b", "player", "idle")
CASE = Case(name="case", parts=(Part(role="player"),), measure=nothing)
ONCE = replace(CASE, name="once", once=True)
IDLE = Case(name="idle", parts=(Part(role="idle"),), measure=nothing)
WORKLOADS = [
    Workload(id="W1", title="", figures=(), cases=(CASE, ONCE)),
    Workload(id="W2", title="", figures=(), cases=(IDLE,)),
]


def test_contenders_take_turns_in_each_repetition() -> None:
    """Repetitions outermost; once is once; nobody plays what he cannot."""
    turns = [(turn.case.name, turn.contender.name, turn.repetition) for turn in plan(WORKLOADS, [A, B], 2)]
    first = [("case", "a", 0), ("case", "b", 0), ("once", "a", 0), ("once", "b", 0), ("idle", "b", 0)]
    assert turns == [*first, ("case", "a", 1), ("case", "b", 1), ("idle", "b", 1)]


def test_who_cannot_play_where_others_can_is_named() -> None:
    """A workload in which nobody can play is not a lack."""
    assert lacking(WORKLOADS, [A, B]) == {"a in W2": "it has no role idle"}
    assert lacking(WORKLOADS, [A]) == {}


async def test_a_failed_trial_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is among the failures, and progress goes on to the end."""

    async def trial(who: Contender, case: Case, seconds: float) -> dict[str, float]:
        if who is A:
            raise TrialError("stage fright")
        return {"seconds": seconds}

    monkeypatch.setattr(runner, "run_trial", trial)
    results = Results(
        machine={}, date="", command="", seconds=1.0, repetitions=1, entrants=[], samples=[], failures=[]
    )
    told: list[Progress] = []
    await run(plan(WORKLOADS, [A, B], 1), results, told.append)
    assert [(each.contender, each.reason) for each in results.failures] == [("a", "stage fright")] * 2
    assert [each.figures for each in results.samples] == [{"seconds": 1.0}] * 3
    parts = [each.part for each in told]
    assert parts == sorted(parts)
    assert parts[0] == 0.0
