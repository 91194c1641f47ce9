"""A run: trials one after another, interleaved, and how far it has come.

Repetitions are outermost and contenders innermost, so that whatever else the machine does meanwhile hits all
contenders alike.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bench.errors import TrialError
from actors.bench.results import Failure, Sample
from actors.bench.trial import missing, run_trial

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.bench.contender import Contender
    from actors.bench.results import Results
    from actors.bench.workloads import Case, Workload

OVERHEAD_S: Final = 0.7
"""A first guess of what starting and stopping a trial's processes takes."""


class Turn(NamedTuple):
    """One trial that is to be run."""

    workload: Workload
    case: Case
    contender: Contender
    repetition: int

    @property
    def title(self) -> str:
        """Such as "W1 256 B nats-py"."""
        return f"{self.workload.id} {self.case.name} {self.contender.name}"


class Progress(NamedTuple):
    """How far a run has come."""

    part: float
    """Done so far, 0 to 1, by expected time."""
    left_s: float
    """Expected time to the end."""
    title: str
    """What is being done."""


@dataclass
class _Pace:
    """Expected and real time of what has been done: how far off the expectation is."""

    total_s: float
    expected_s: float = 0.0

    def __post_init__(self) -> None:
        self._began = time.monotonic()

    def progress(self, title: str) -> Progress:
        taken_s = time.monotonic() - self._began
        factor = taken_s / self.expected_s if self.expected_s else 1.0
        return Progress(self.expected_s / self.total_s, factor * (self.total_s - self.expected_s), title)


def plan(workloads: Iterable[Workload], contenders: Iterable[Contender], repetitions: int) -> list[Turn]:
    """Return the trials in the order in which they are run."""
    contenders = list(contenders)
    workloads = list(workloads)
    return [
        Turn(workload, case, contender, repetition)
        for repetition in range(repetitions)
        for workload in workloads
        for case in workload.cases
        for contender in contenders
        if not missing(contender, case) and not (case.once and repetition)
    ]


def lacking(workloads: Iterable[Workload], contenders: Iterable[Contender]) -> dict[str, str]:
    """Return which contenders cannot play in a workload that some of them can play in, and why."""
    contenders = list(contenders)
    said: dict[str, str] = {}
    for workload in workloads:
        lacks = {each.name: missing(each, workload.cases[0]) for each in contenders}
        if all(lacks.values()):
            continue
        for name, roles in lacks.items():
            if roles:
                said[f"{name} in {workload.id}"] = f"it has no role {', '.join(roles)}"
    return said


async def run(turns: list[Turn], results: Results, tell: Callable[[Progress], None]) -> None:
    """Run trials, put what they give into `results`, and tell before each how far we are."""
    pace = _Pace(sum(_expected_s(turn, results.seconds) for turn in turns))
    for turn in turns:
        tell(pace.progress(turn.title))
        where = {
            "workload": turn.workload.id,
            "case": turn.case.name,
            "contender": turn.contender.name,
        }
        try:
            figures = await run_trial(turn.contender, turn.case, results.seconds)
        except (TrialError, OSError, ArithmeticError) as error:  # TimeoutError is an OSError
            results.failures.append(Failure(**where, repetition=turn.repetition, reason=str(error)))
        else:
            results.samples.append(Sample(**where, repetition=turn.repetition, figures=figures))
        pace.expected_s += _expected_s(turn, results.seconds)


def _expected_s(turn: Turn, seconds: float) -> float:
    return OVERHEAD_S + turn.case.extra_s + (0.0 if turn.case.connections else seconds)
