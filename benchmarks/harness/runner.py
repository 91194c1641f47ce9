"""Runs trials one after another and reports the progress.

Repetitions are outermost and contenders innermost, so that other load on the machine affects all contenders
alike.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from benchmarks.harness.errors import TrialError
from benchmarks.harness.results import Failure, Sample
from benchmarks.harness.trial import missing, run_trial

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from benchmarks.harness.contender import Contender
    from benchmarks.harness.results import Results
    from benchmarks.harness.workloads import Case, Workload

OVERHEAD_S: Final = 0.7
"""First estimate of the time to start and stop a trial's processes."""


class PlannedTrial(NamedTuple):
    """A trial to run."""

    workload: Workload
    case: Case
    contender: Contender
    repetition: int

    @property
    def title(self) -> str:
        """Such as "W1 256 B nats-py"."""
        return f"{self.workload.id} {self.case.name} {self.contender.name}"


class Progress(NamedTuple):
    """The progress of a benchmark."""

    part: float
    """Completed fraction, 0 to 1, by expected time."""
    left_s: float
    """Expected time to the end."""
    title: str
    """The current trial."""


@dataclass
class _Pace:
    """Compares expected and real time of the trials so far."""

    total_s: float
    expected_s: float = 0.0

    def __post_init__(self) -> None:
        self._began = time.monotonic()

    def progress(self, title: str) -> Progress:
        taken_s = time.monotonic() - self._began
        factor = taken_s / self.expected_s if self.expected_s else 1.0
        return Progress(self.expected_s / self.total_s, factor * (self.total_s - self.expected_s), title)


def plan(
    workloads: Iterable[Workload], contenders: Iterable[Contender], repetitions: int
) -> list[PlannedTrial]:
    """Return the trials in order."""
    contenders = list(contenders)
    workloads = list(workloads)
    return [
        PlannedTrial(workload, case, contender, repetition)
        for repetition in range(repetitions)
        for workload in workloads
        for case in workload.cases
        for contender in contenders
        if not missing(contender, case) and not (case.once and repetition)
    ]


def lacking(workloads: Iterable[Workload], contenders: Iterable[Contender]) -> dict[str, str]:
    """Return which contenders cannot run a workload that others can, and why."""
    contenders = list(contenders)
    reasons: dict[str, str] = {}
    for workload in workloads:
        lacks = {each.name: missing(each, workload.cases[0]) for each in contenders}
        if all(lacks.values()):
            continue
        for name, roles in lacks.items():
            if roles:
                reasons[f"{name} in {workload.id}"] = f"it has no role {', '.join(roles)}"
    return reasons


async def run(trials: list[PlannedTrial], results: Results, report: Callable[[Progress], None]) -> None:
    """Run trials, add their figures to `results`, and report the progress before each."""
    pace = _Pace(sum(_expected_s(trial, results.seconds) for trial in trials))
    for trial in trials:
        report(pace.progress(trial.title))
        where = {
            "workload": trial.workload.id,
            "case": trial.case.name,
            "contender": trial.contender.name,
        }
        try:
            figures = await run_trial(trial.contender, trial.case, results.seconds)
        except (TrialError, OSError, ArithmeticError) as error:  # TimeoutError is an OSError
            results.failures.append(Failure(**where, repetition=trial.repetition, reason=str(error)))
        else:
            results.samples.append(Sample(**where, repetition=trial.repetition, figures=figures))
        pace.expected_s += _expected_s(trial, results.seconds)


def _expected_s(trial: PlannedTrial, seconds: float) -> float:
    return OVERHEAD_S + trial.case.extra_s + (0.0 if trial.case.connections else seconds)
