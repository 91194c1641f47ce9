"""callboard and its peers, measured together: every role a process, trials interleaved, results in docs/.

    python benchmarks/suite.py                      everything, about ten minutes
    python benchmarks/suite.py W1 W3 --peers nats_py,zenoh_router --repetitions 5
    python benchmarks/suite.py --report-only        tables and plot again, from docs/performance.json

A whole run, or one with --write, writes docs/performance.json, and from it docs/performance.svg and the parts
between markers in docs/performance.md (for users) and docs/development/performance-targets.md (for
developers). A run of some workloads or peers only prints its tables.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import shlex
import sys
import time
from datetime import UTC, datetime
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.harness.contender import Contender

ROOT = Path(__file__).resolve().parent.parent
# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(ROOT)

import msgspec

import actors
from actors.cli.bench import machine
from benchmarks import plot, report
from benchmarks.harness.own import callboard
from benchmarks.harness.progress import line
from benchmarks.harness.results import Entrant, Results
from benchmarks.harness.runner import Progress, lacking, plan, run
from benchmarks.harness.workloads import WORKLOADS
from benchmarks.peers import PEERS

JSON = ROOT / "docs" / "performance.json"
PAGE = ROOT / "docs" / "performance.md"
TARGETS = ROOT / "docs" / "development" / "performance-targets.md"
PLOT = ROOT / "docs" / "performance.svg"
INTERRUPTED = 130


def main() -> int:
    """Measure and report, or report only; return the exit code."""
    options = _options()
    if not options.report_only:
        results = actors.run(lambda: _measured(options), args=[])
        if results is None:  # a signal has ended it, and every process with it
            return INTERRUPTED
        if not options.write:
            print(report.body(results), report.targets(results), sep="\n\n")
            return _exit_code(results)
        JSON.write_text(
            msgspec.json.format(msgspec.json.encode(results.document()), indent=1).decode() + "\n"
        )
    results = msgspec.json.decode(JSON.read_bytes(), type=Results)
    for page, text in ((PAGE, report.body(results)), (TARGETS, report.targets(results))):
        page.write_text(report.updated(page.read_text("utf-8"), text), "utf-8")
    if find_spec("matplotlib") is None:
        print("no plot: matplotlib is not installed (make bench installs it)")
    else:
        plot.draw(results, PLOT)
    print("written:", *(path.relative_to(ROOT) for path in (PAGE, TARGETS, JSON, PLOT)))
    return _exit_code(results)


def _exit_code(results: Results) -> int:
    """A peer that fails is reported; callboard must not."""
    return int(any(failure.contender.startswith("callboard") for failure in results.failures))


def _options() -> argparse.Namespace:
    ids = [workload.id for workload in WORKLOADS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("workloads", nargs="*", metavar="WORKLOAD", help="of W1 to W12; default: all")
    parser.add_argument("--peers", default=",".join(PEERS), help=f"default: {','.join(PEERS)}")
    parser.add_argument("--repetitions", type=int, default=3, help="of each case; default: 3")
    parser.add_argument("--seconds", type=float, default=1.0, help="length of each load; default: 1")
    parser.add_argument("--write", action="store_true", help="into docs/, also if it is not a whole run")
    parser.add_argument("--report-only", action="store_true", help="measure nothing")
    options = parser.parse_args()
    unknown = {*options.workloads} - {*ids} or {*filter(None, options.peers.split(","))} - {*PEERS}
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    options.write |= not options.workloads and options.peers == parser.get_default("peers")
    return options


async def _measured(options: argparse.Namespace) -> Results:
    """Run the trials; say who is skipped, how far it is, and what fails."""
    contenders, skipped = _contenders([name for name in options.peers.split(",") if name])
    workloads = [each for each in WORKLOADS if not options.workloads or each.id in options.workloads]
    skipped |= lacking(workloads, [each for each in contenders if not each.name.startswith("callboard")])
    for name, reason in skipped.items():
        print(f"skipped: {name}: {reason}")
    trials = plan(workloads, contenders, options.repetitions)
    results = Results(
        machine=machine.describe(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        command=shlex.join(["python", "benchmarks/suite.py", *sys.argv[1:]]),
        seconds=options.seconds,
        repetitions=options.repetitions,
        entrants=[Entrant.of(contender) for contender in contenders],
        skipped=skipped,
    )
    began = time.monotonic()
    log = _Log(results)
    await run(trials, results, log)
    log.failures()
    print(
        f"{len(results.samples)} trials in {time.monotonic() - began:.0f} s, {len(results.failures)} failed"
    )
    return results


class _Log:
    """Prints a line for each trial, and why a trial before it has failed."""

    def __init__(self, results: Results) -> None:
        self._results = results
        self._printed = 0

    def __call__(self, progress: Progress) -> None:
        self.failures()
        print(line(progress), flush=True)

    def failures(self) -> None:
        for failure in self._results.failures[self._printed :]:
            print(f"failed: {failure.workload} {failure.case} {failure.contender}: {failure.reason}")
        self._printed = len(self._results.failures)


def _contenders(peers: list[str]) -> tuple[list[Contender], dict[str, str]]:
    """Return callboard in its forms and the peers that are there; and the others, with the reason."""
    found = [
        callboard(),
        callboard(loop="asyncio"),
        callboard(transport="tcp"),
        callboard(transport="tls"),
        callboard(rules=1000),
        callboard(shared_memory=False),
    ]
    skipped: dict[str, str] = {}
    for name in peers:
        module: Any = import_module(f"benchmarks.peers.{name}")
        peer: Contender | str = module.find()
        if isinstance(peer, str):
            skipped[name] = peer
        else:
            found.append(peer)
    return found, skipped


if __name__ == "__main__":
    sys.exit(main())
