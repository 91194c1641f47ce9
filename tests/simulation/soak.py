"""Simulate histories for a given time: `python -m tests.simulation.soak --minutes 60`.

Worker processes run one seed after the other, each once calm and once troubled. A violation is reported at
once, with the command that reproduces it. A history that does not end, or that crashes its process, is a
violation, too, and does not stop the others.
"""

from __future__ import annotations

import argparse
import gc
import json
import multiprocessing
import os
import signal
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from tests.simulation.histories import History, kind_of, live, live_in_mesh, replay

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Live: TypeAlias = Callable[..., History]

HANG_SEC: Final = 60.0
"""Processor time that a history has. The slowest take a few seconds."""

WALL_CLOCK_FACTOR: Final = 10
"""So many times as long it may take on the wall clock: others may be using the machine."""

PROGRESS_SEC: Final = 60.0

DEFAULT_MINUTES: Final = 5.0


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What to do.

    Attributes:
        minutes: Begin no history after so long.
        first_seed: Where to start.
        seeds: How many seeds at most; None for as many as there is time for.
        processes: How many at the same time.
        hang_sec: Processor time that one history has.
        mesh: Whether the histories are of meshes of brokers.
    """

    minutes: float = DEFAULT_MINUTES
    first_seed: int = 0
    seeds: int | None = None
    processes: int = field(default_factory=lambda: os.cpu_count() or 1)
    hang_sec: float = HANG_SEC
    mesh: bool = False

    def jobs(self) -> Iterator[tuple[int, bool]]:
        """Yield seeds, and whether the history is calm."""
        seed = self.first_seed
        while self.seeds is None or seed < self.first_seed + self.seeds:
            yield seed, True
            yield seed, False
            seed += 1


@dataclass
class Tally:
    """What has come of it.

    Attributes:
        next_seed: Where to go on.
        violations: Seed, kind of history, what is wrong, and the command that shows it again.
    """

    next_seed: int
    mesh: bool = False
    histories: int = 0
    simulated_s: float = 0.0
    wall_s: float = 0.0
    checks: int = 0
    struck: Counter[str] = field(default_factory=Counter)
    violations: list[dict[str, Any]] = field(default_factory=list)

    def add(self, history: History) -> None:
        """Count a history."""
        self.histories += 1
        self.simulated_s += history.seconds
        self.checks += history.checks
        self.struck.update(history.struck)

    def violated(self, seed: int, *, calm: bool, wrong: str) -> None:
        """A promise was broken."""
        kind, again = kind_of(calm=calm), replay(seed, calm=calm, mesh=self.mesh)
        self.violations.append({"seed": seed, "kind": kind, "wrong": wrong, "replay": again})

    def line(self) -> str:
        """Return where it stands, in a line."""
        return (
            f"{self.wall_s / 60:.1f} min: {self.histories:,} histories before seed {self.next_seed},"
            f" {self.simulated_s / 3600:.1f} simulated hours, {self.struck.total():,} faults,"
            f" {len(self.violations)} violations"
        )

    def summary(self) -> str:
        """Return everything, in lines."""
        lines = ["", self.line(), f"the sums were checked {self.checks:,} times", "faults:"]
        lines += [f"  {name:<16}{count:>8,}" for name, count in sorted(self.struck.items())]
        for violation in self.violations:
            lines += [f"violation: {violation['wrong'].splitlines()[0]}", f"  {violation['replay']}"]
        return "\n".join(lines)


def _work(pipe: Connection, live: Live) -> None:
    """A worker's life: seeds come, histories go, until nothing comes."""
    gc.collect()
    gc.freeze()  # what is there before the first history need not be collected before each
    pipe.send(None)  # ready: what it has taken to get here is no history's time
    try:
        while (job := pipe.recv()) is not None:
            seed, calm = job
            pipe.send(live(seed, calm=calm))
    except (EOFError, KeyboardInterrupt):
        return


def _live_as(plan: Plan) -> Live:
    return live_in_mesh if plan.mesh else live


class _Worker:
    """One process, and the history it is at."""

    def __init__(self, live: Live) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, there = context.Pipe()
        self.process = context.Process(target=_work, args=(there, live), daemon=True)
        self.process.start()
        there.close()
        self.ready = False
        self.job: tuple[int, bool] | None = None
        self._began = self._used = 0.0

    def give(self, job: tuple[int, bool]) -> None:
        """Begin a history."""
        self.job, self._began, self._used = job, time.monotonic(), self._processor_s() or 0.0
        self.pipe.send(job)

    def hangs(self, limit_s: float) -> bool:
        """Tell whether its history takes too long."""
        wall, used = time.monotonic() - self._began, self._processor_s()
        return wall > limit_s and (
            used is None or used - self._used > limit_s or wall > WALL_CLOCK_FACTOR * limit_s
        )

    def _processor_s(self) -> float | None:
        """Return how much processor time it has used; None where the system does not report it."""
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            return None
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


class Soak:
    """A pool of workers that lives through a plan.

    Args:
        plan: What to do.
        live: Lives through one history; a function that a new process can import. By default as planned.
        print_line: Takes each line of progress.
    """

    def __init__(
        self, plan: Plan, live: Live | None = None, print_line: Callable[[str], object] = print
    ) -> None:
        self.tally = Tally(plan.first_seed, plan.mesh)
        self._plan = plan
        self._live = live or _live_as(plan)
        self._print_line = print_line
        self._jobs = plan.jobs()
        self._next = next(self._jobs, None)
        self._began = time.monotonic()
        self._printed_at = self._began
        self._workers: list[_Worker] = []

    def run(self) -> Tally:
        """Do it all; an interrupt ends it early."""
        self._workers = [_Worker(self._live) for _ in range(self._plan.processes)]
        try:
            while self._give_out():
                self._take_back()
                self._replace_hanging()
                self._progress()
        except KeyboardInterrupt:
            self._print_line("interrupted")
        finally:
            for worker in self._workers:
                worker.end()
        self.tally.wall_s = time.monotonic() - self._began
        return self.tally

    def _give_out(self) -> bool:
        """Give who is ready a history; tell whether anything is still to be done."""
        if time.monotonic() - self._began > self._plan.minutes * 60:
            self._next = None
        for worker in self._workers:
            if worker.ready and worker.job is None and self._next is not None:
                seed, calm = self._next
                self.tally.next_seed = seed if calm else seed + 1
                worker.give(self._next)
                self._next = next(self._jobs, None)
        return self._next is not None or any(worker.job for worker in self._workers)

    def _take_back(self) -> None:
        waiting = {worker.pipe: worker for worker in self._workers if worker.job or not worker.ready}
        for pipe in wait(list(waiting), timeout=1.0):
            worker = waiting[pipe]  # type: ignore[index]
            try:
                history: History | None = worker.pipe.recv()
            except EOFError:
                worker.process.join()
                self._replace(worker, f"the process ended with {worker.process.exitcode}")
                continue
            if history is None:
                worker.ready = True
                continue
            self.tally.add(history)
            job, worker.job = worker.job, None
            if history.wrong and job is not None:
                self._violated(job, history.wrong)

    def _replace_hanging(self) -> None:
        for worker in self._workers:
            if worker.job is not None and worker.hangs(self._plan.hang_sec):
                self._replace(worker, f"it takes more than {self._plan.hang_sec:g} s")

    def _replace(self, worker: _Worker, wrong: str) -> None:
        job = worker.job
        if job is None:
            raise RuntimeError(f"A worker cannot start: {wrong}")
        self._violated(job, f"seed {job[0]}: {wrong}")
        worker.end()
        self._workers[self._workers.index(worker)] = _Worker(self._live)

    def _violated(self, job: tuple[int, bool], wrong: str) -> None:
        seed, calm = job
        self.tally.violated(seed, calm=calm, wrong=wrong)
        self._print_line(f"violation: {wrong}")

    def _progress(self) -> None:
        now = time.monotonic()
        if now - self._printed_at >= PROGRESS_SEC:
            self._printed_at = now
            self.tally.wall_s = now - self._began
            self._print_line(self.tally.line())


def main(argv: list[str] | None = None) -> int:
    """Run a soak; return 1 if a promise was broken, or if no history came to its end."""
    plan = Plan()
    parser = argparse.ArgumentParser(prog="python -m tests.simulation.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=plan.minutes, help="for how long")
    parser.add_argument("--first-seed", type=int, default=0, help="where to start")
    parser.add_argument("--seeds", type=int, help="how many seeds at most")
    parser.add_argument("--processes", type=int, default=plan.processes, help="how many at the same time")
    parser.add_argument("--mesh", action="store_true", help="simulate meshes of three to five brokers")
    parser.add_argument("--json", type=Path, help="write the result there, too")
    chosen = parser.parse_args(argv)
    plan = Plan(
        minutes=chosen.minutes,
        first_seed=chosen.first_seed,
        seeds=chosen.seeds,
        processes=chosen.processes,
        mesh=chosen.mesh,
    )
    tally = Soak(plan, print_line=_print_line).run()
    _print_line(tally.summary())
    if chosen.json is not None:
        chosen.json.write_text(json.dumps(vars(tally), indent=2) + "\n")
    return 1 if tally.violations or not tally.histories else 0


def _print_line(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):  # in the background of a script SIGINT is ignored
        signal.signal(number, signal.default_int_handler)
    raise SystemExit(main())
