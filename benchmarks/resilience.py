"""Measure failures and restarts with real processes.

    python benchmarks/resilience.py                    everything, about three minutes
    python benchmarks/resilience.py presence --rounds 20
    python benchmarks/resilience.py restart --nodes 50 --json out.json
    python benchmarks/resilience.py --report-only      generate the page from docs/resilience.json

Prints a table for each; exits with 1 if a promise was violated. --write merges the results into
docs/resilience.json and generates the tables of docs/explanation/resilience.md from it.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parent.parent
# Not this folder itself: its modules must not shadow others.
sys.path[0] = str(ROOT)
# The roles are modules of this folder, too.
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])

import msgspec

import actors
from actors.cli.bench import machine
from benchmarks.faults import churn, freeze, page, presence, restart

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.faults.figures import Section

MEASUREMENTS = ("presence", "wait", "freeze", "restart", "churn")
JSON = ROOT / "docs" / "resilience.json"
PAGE = ROOT / "docs" / "explanation" / "resilience.md"
INTERRUPTED = 130


def main() -> int:
    """Measure and print; write if asked; return the exit code."""
    options = parse(sys.argv[1:])
    if options.report_only:
        _write_page(_load())
        return 0
    sections = actors.run(lambda: measure(options), args=[])
    if sections is None:  # ended by a signal, with all its processes
        return INTERRUPTED
    report = page.Report(
        machine=machine.describe(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        sections={section.key: section for section in sections},
    )
    if options.json is not None:
        options.json.write_bytes(_encoded(report))
    if options.write:
        if JSON.exists():
            report = report.merged_with(_load())
        JSON.write_bytes(_encoded(report))
        _write_page(report)
    return int(any(section.failures for section in sections))


def _load() -> page.Report:
    return msgspec.json.decode(JSON.read_bytes(), type=page.Report)


def _encoded(report: page.Report) -> bytes:
    return msgspec.json.format(msgspec.json.encode(report), indent=1) + b"\n"


def _write_page(report: page.Report) -> None:
    PAGE.write_text(page.update_page(PAGE.read_text("utf-8"), report), "utf-8")
    print(f"written: {PAGE.relative_to(ROOT)}")


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", nargs="?", default="all", choices=[*MEASUREMENTS, "all"], help="default: all")
    parser.add_argument(
        "--rounds", type=int, default=50, help="of presence and wait, a tenth of them of freeze; default: 50"
    )
    parser.add_argument("--nodes", type=int, default=200, help="of restart; default: 200")
    parser.add_argument("--lives", type=int, default=3 * churn.HOUR, help="of churn; default: three hours'")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to this file")
    parser.add_argument("--write", action="store_true", help="write the results into docs/")
    parser.add_argument("--report-only", action="store_true", help="measure nothing")
    return parser.parse_args(arguments)


async def measure(options: argparse.Namespace) -> list[Section]:
    """Run the selected measurements; print each table when it is complete."""
    wanted = MEASUREMENTS if options.what == "all" else (options.what,)
    found: list[Section] = []

    def add(section: Section) -> None:
        if section.key in wanted:
            found.append(section)
            print("\n".join(section.lines()), flush=True)

    if {"presence", "wait"} & {*wanted}:
        by_load = {
            "idle": await presence.measure(options.rounds, busy=False),
            "busy": await presence.measure(options.rounds, busy=True),
        }
        add(presence.presence_section(by_load))
        add(presence.wait_section(by_load))
    if "freeze" in wanted:
        add(freeze.section(await freeze.measure(max(1, options.rounds // 10))))
    if "restart" in wanted:
        add(restart.section(await restart.measure(restart.Plan(nodes=options.nodes))))
    if "churn" in wanted:
        add(churn.section(await churn.measure(options.lives)))
    return found


if __name__ == "__main__":
    sys.exit(main())
