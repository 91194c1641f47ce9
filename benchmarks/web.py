"""Measure the page with real processes, and Chromium in front of it.

    python benchmarks/web.py                          everything, about twenty minutes
    python benchmarks/web.py interaction --nodes 200 --inputs 50
    python benchmarks/web.py memory --minutes 2 --json out.json

Prints a table for each; exits with 1 if a target is missed. Needs the extras web and browser, and Chromium.
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
from benchmarks.browser import interaction, loading, memory, node_cost, scrape, throughput
from benchmarks.faults.page import Report

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Sequence

    from benchmarks.faults.figures import Section

MEASUREMENTS = ("loading", "interaction", "memory", "throughput", "scrape", "node")
INTERRUPTED = 130


def main() -> int:
    """Measure and print; return the exit code."""
    options = parse(sys.argv[1:])
    sections = actors.run(lambda: measure(options), args=[])
    if sections is None:  # ended by a signal, with all its processes
        return INTERRUPTED
    if options.json is not None:
        report = Report(
            machine=machine.describe(),
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            sections={section.key: section for section in sections},
        )
        options.json.write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=1) + b"\n")
    return int(any(section.failures for section in sections))


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "what", nargs="*", metavar="WHAT", help=f"measurements: {', '.join(MEASUREMENTS)}; default: all"
    )
    parser.add_argument("--nodes", type=int, default=500, help="nodes in the graph; default: 500")
    parser.add_argument(
        "--rounds",
        type=int,
        default=10,
        help="rounds of loading; throughput and node take twice as many; default: 10",
    )
    parser.add_argument(
        "--minutes", type=int, default=10, help="length of the memory measurement; default: 10"
    )
    parser.add_argument(
        "--inputs", type=int, default=100, help="inputs of each kind, and scrapes; default: 100"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to this file")
    options = parser.parse_args(arguments)
    if unknown := {*options.what} - {*MEASUREMENTS}:
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    return options


async def measure(options: argparse.Namespace) -> list[Section]:
    """Run the selected measurements; print each table when it is complete."""
    found: list[Section] = []
    async for section in _sections(options):
        found.append(section)
        print("\n".join(section.lines()), flush=True)
    return found


async def _sections(options: argparse.Namespace) -> AsyncIterator[Section]:
    wanted = options.what or MEASUREMENTS
    if "loading" in wanted:
        yield loading.section(await loading.measure(options.rounds, options.nodes))
    if "interaction" in wanted:
        times, blocked = await interaction.measure(options.inputs, options.nodes)
        yield interaction.section(times, blocked, options.nodes)
    if "memory" in wanted:
        yield memory.section(await memory.measure(options.minutes, options.nodes))
    if "throughput" in wanted:
        yield throughput.section(await throughput.measure(2 * options.rounds, options.nodes))
    if "scrape" in wanted:
        yield scrape.section(*await scrape.measure(options.inputs))
    if "node" in wanted:
        yield node_cost.section(await node_cost.measure(2 * options.rounds))


if __name__ == "__main__":
    sys.exit(main())
