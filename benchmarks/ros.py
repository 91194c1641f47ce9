"""A program written for rclpy, on callboard and on ROS 2, which `make test` puts into build/ros2.

    python benchmarks/ros.py                   all rows, about five minutes
    python benchmarks/ros.py spin_once 64      the rows whose names have these words

Each role of a program is a process of its own, as is callboard's broker. Rounds of both sides alternate;
each figure is the median, and `cpu_us` the CPU time of a message or call in all processes together. Without
ROS 2 callboard is measured alone.
"""
# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT)  # `python benchmarks/ros.py` puts this folder there

from benchmarks.harness import meters
from benchmarks.threads import broker_process

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

PROGRAM: Final = str(Path(__file__).with_name("ros_program.py"))
REAL_PYTHON: Final = ROOT / "build" / "ros2" / "bin" / "python"
SIDES: Final = {
    "callboard": (sys.executable, "-m", "actors.ros", "--no-broker", PROGRAM),
    "ROS 2": (str(REAL_PYTHON), PROGRAM),
}
DOMAIN: Final = "97"
SIZES: Final = {"256 B": 256, "64 KiB": 65_536, "1 MiB": 1_048_576}
END_SEC: Final = 60
"""How long a process may take after its load."""


class Row(NamedTuple):
    """A pattern of messages, calls or timers.

    Attributes:
        name: Its name.
        roles: The roles in the order of their start; the last one ends by itself.
        parameters: Their parameters.
        figure: What is compared.
        more: Whether more of it is better.
    """

    name: str
    roles: tuple[str, ...]
    parameters: Mapping[str, object]
    figure: str = "rate"
    more: bool = True


def _rows() -> Iterator[Row]:
    for how in ("spin", "spin_once", "threads"):
        for raw in (False, True):
            for name, size in SIZES.items():
                kind = "raw" if raw else "typed"
                parameters = {"how": how, "raw": raw, "size": size}
                yield Row(f"{how} {name} {kind}", ("subscriber", "publisher"), parameters)
    for calls in (1, 100):
        yield Row(f"{calls} calls in flight", ("server", "client"), {"how": "many", "calls": calls})
    one = {"how": "one", "calls": 1}
    yield Row("one call, p50 us", ("server", "client"), one, "p50_us", more=False)
    yield Row("timer of 1 ms, part of a CPU", ("timer",), {}, "cpu", more=False)
    yield Row("timer of 1 ms, p99 jitter us", ("timer",), {}, "p99_us", more=False)
    yield Row("idle, part of a CPU", ("idle",), {}, "cpu", more=False)
    for name, figure in {"start ms": "start_ms", "RSS MiB": "rss_mib", "PSS MiB": "pss_mib"}.items():
        yield Row(f"a process with one node, {name}", ("one_node",), {}, figure, more=False)


def measure(side: str, row: Row, seconds: float) -> dict[str, float]:
    """Run a row's roles once; return the figure and the CPU time of a message or call."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        environment = {**os.environ, "ROS_DOMAIN_ID": DOMAIN, "ROS_LOG_DIR": folder}
        broker = 0
        if side == "callboard":
            environment["CALLBOARD_URL"], broker = stack.enter_context(broker_process())
        given = {**row.parameters, "seconds": seconds}
        if row.roles == ("one_node",):
            given["began"] = time.time()
        parameters = json.dumps(given)
        started = [
            stack.enter_context(
                subprocess.Popen(
                    [*SIDES[side], role, parameters], env=environment, stdout=subprocess.PIPE, text=True
                )
            )
            for role in row.roles
        ]
        for process in started:
            stack.callback(process.kill)
        before = meters.cpu_s(broker) if broker else None
        # A server ends when its client has ended.
        waits = started[-1:] if row.roles[0] == "server" else started
        figures = [_figures(process, seconds) for process in waits]
        after = meters.cpu_s(broker) if broker else None
    if len({each["count"] for each in figures if "count" in each}) > 1:
        raise SystemExit(f"{side}, {row.name}: of {figures[1]['count']} messages {figures[0]['count']} came")
    cpu_us = sum(each.get("cpu_us", 0.0) for each in figures)
    if before is not None and after is not None and "count" in figures[0]:
        cpu_us += 1e6 * (after - before) / figures[0]["count"]
    return {row.figure: figures[0][row.figure], "cpu_us": cpu_us}


def _figures(process: subprocess.Popen[str], seconds: float) -> dict[str, float]:
    out, _ = process.communicate(timeout=seconds + END_SEC)
    if process.returncode:
        raise SystemExit(f"{process.args!r} failed")
    found: dict[str, float] = json.loads(out.splitlines()[-1])
    return found


def main() -> None:
    """Measure rows and print them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("words", nargs="*", help="of the names of rows; default: all rows")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=2.0, help="length of each load; default: 2")
    parser.add_argument("--side", choices=SIDES, help="measure one side only")
    options = parser.parse_args()
    rows = [row for row in _rows() if all(word in row.name for word in options.words)]
    sides = [side for side in SIDES if options.side in {None, side}]
    if not REAL_PYTHON.exists():
        sides.remove("ROS 2")
    for row in rows:
        rounds = {side: list[dict[str, float]]() for side in sides}
        for _ in range(options.rounds):
            for side in sides:
                rounds[side].append(measure(side, row, options.seconds))
        print(row.name, *_cells(row, rounds), sep="  |  ", flush=True)


def _cells(row: Row, rounds: Mapping[str, list[dict[str, float]]]) -> Iterator[str]:
    medians = {
        key: {side: statistics.median(each[key] for each in found) for side, found in rounds.items()}
        for key in (row.figure, "cpu_us")
    }
    for key, figures in medians.items():
        if not any(figures.values()):
            continue
        compared = ", ".join(f"{side} {value:,.4g}" for side, value in figures.items())
        yield (f"{key}: {compared}" if len(figures) == 1 else f"{key}: {compared} ({_times(figures)} x)")


def _times(figures: Mapping[str, float]) -> str:
    callboard, real = figures["callboard"], figures["ROS 2"]
    return f"{callboard / real:.2f}" if real else "-"


if __name__ == "__main__":
    main()
