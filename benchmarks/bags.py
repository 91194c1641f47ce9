"""How fast bags are recorded and played through a broker, next to `mcap`'s own writer and reader.

    pip install -e '.[bags]'
    python benchmarks/bags.py                       # record, play, info and timing
    python benchmarks/bags.py memory --gibibytes 20

`record`: a recorder, which is lossless, next to `mcap`'s writer fed from memory with the same messages; both
write chunks of the same size and compression. `play`: a player that publishes as fast as possible, to a
listener that loses nothing, next to `mcap`'s reader of the same file, which does nothing with what it reads.
`info`: what a file of 10 GB has, next to `mcap`. `timing`: how much the intervals of a bag of 1 kHz differ
from those at which its messages are received; on an idle machine. `memory`: that of a recorder, meanwhile.

Broker, publisher, recorder and all others are processes of their own, which `bag_programs.py` has. Those that
are compared run in turns; the medians of all rounds count: messages a second, and messages for each second of
CPU time of the process that records, plays, writes or reads. Ends with 1 if a target is missed.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from benchmarks.bag_programs import STEP_NS, WORKLOADS, Figures
from benchmarks.threads import broker_process

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

PROGRAMS = Path(__file__).with_name("bag_programs.py")
INFO_TARGET, INFO_SEC = 0.5, 0.3
TIMING_MESSAGES, TIMING_MS = 10_000, 1.0
SPARE_MIB = 30
"""What a recorder's memory may grow by after the first fifth of a recording, beside its cache."""


class Bench:
    """Runs programs in folders, and keeps what they print.

    Args:
        options: The command line.

    Attributes:
        figures: By row.
        missed: The rows that miss their target.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.figures: dict[str, Figures] = {}
        self.missed: list[str] = []

    @contextmanager
    def folder(self) -> Generator[Path]:
        """Yield a new folder."""
        with tempfile.TemporaryDirectory(dir=self.options.folder) as folder:
            yield Path(folder)

    def run(self, role: str, folder: Path, **arguments: Any) -> Figures:
        """Run a program, and return what it prints."""
        return _result(_start(role, folder, arguments))

    def compare(
        self, row: str, target: float, ours: Callable[[Path], Figures], theirs: Callable[[Path], Figures]
    ) -> None:
        """Run two programs in turns, and report the ratio of the medians."""
        found: tuple[list[Figures], list[Figures]] = [], []
        for _ in range(self.options.rounds):
            for results, function in zip(found, (ours, theirs), strict=True):
                with self.folder() as folder:
                    results.append(function(folder))
        our, their = ({key: statistics.median(each[key] for each in one) for key in one[0]} for one in found)
        ratio, cpu = our["wall"] / their["wall"], our["cpu"] / their["cpu"]
        self.report(
            row,
            {"callboard": our, "mcap": their, "ratio": ratio, "cpu_ratio": cpu, "target": target},
            f"{our['wall']:,.0f}/s next to {their['wall']:,.0f}/s: {ratio:.2f}, at least {target};"
            f" for a second of CPU {our['cpu']:,.0f} and {their['cpu']:,.0f}: {cpu:.2f}",
            is_missed=ratio < target,
        )

    def report(self, row: str, figures: Figures, text: str, *, is_missed: bool) -> None:
        """Print a row, and keep it."""
        self.figures[row] = figures
        if is_missed:
            self.missed.append(row)
        print(f"{row}: {text}{' (missed)' if is_missed else ''}", flush=True)


def _start(role: str, folder: Path, arguments: Figures) -> subprocess.Popen[str]:
    command = [sys.executable, str(PROGRAMS), role, str(folder), json.dumps(arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _result(process: subprocess.Popen[str]) -> Figures:
    with process:
        output = process.communicate()[0]
    if process.returncode:
        raise SystemExit(f"{process.args!r} ended with {process.returncode}")
    found: Figures = json.loads(output)
    return found


def record(bench: Bench) -> None:
    """Compare recording with `mcap`'s writer."""
    compression = bench.options.compression
    with broker_process() as (url, _):
        for name in bench.options.workload:
            bench.compare(
                f"record {name}",
                WORKLOADS[name].record_target,
                partial(bench.run, "record", url=url, workload=name, compression=compression),
                partial(bench.run, "write", workload=name, compression=compression),
            )


def play(bench: Bench) -> None:
    """Compare playing with `mcap`'s reader."""
    with broker_process() as (url, _):
        for name in bench.options.workload:
            with bench.folder() as bag:
                bench.run("prepare", bag, workload=name)
                bench.compare(
                    f"play {name}",
                    WORKLOADS[name].play_target,
                    partial(_play_once, bag, url, name),
                    partial(_read_once, bench, bag, name),
                )


def _played(bag: Path, url: str, name: str, rate: float = 1e9, messages: int = 0) -> tuple[Figures, Figures]:
    """Play a bag, and return what the player and the listener say."""
    listener = _start("listen", bag, {"url": url, "workload": name, "messages": messages})
    try:
        player = _result(_start("play", bag, {"url": url, "workload": name, "rate": rate}))
        return player, _result(listener)
    finally:
        listener.kill()


def _play_once(bag: Path, url: str, name: str, _: Path) -> Figures:
    return _played(bag, url, name)[0]


def _read_once(bench: Bench, bag: Path, name: str, _: Path) -> Figures:
    return bench.run("read", bag, workload=name)


def info(bench: Bench) -> None:
    """Compare what says what a file of 10 GB has."""
    with bench.folder() as bag:
        bench.run("prepare_large", bag)
        bench.compare(
            "info on 10 GB",
            INFO_TARGET,
            lambda _: bench.run("summarize", bag),
            lambda _: bench.run("summarize_by_mcap", bag),
        )
    slowest = 1 / bench.figures["info on 10 GB"]["callboard"]["wall"]
    bench.report(
        "info, seconds", {"sec": slowest}, f"{slowest:.3f}, below {INFO_SEC}", is_missed=slowest > INFO_SEC
    )


def timing(bench: Bench) -> None:
    """Measure how exactly a bag of 1 kHz is played."""
    name = "256 B, one topic"
    with broker_process() as (url, _), bench.folder() as bag:
        bench.run("prepare", bag, workload=name, messages=TIMING_MESSAGES)
        times = _played(bag, url, name, rate=1.0, messages=TIMING_MESSAGES)[1]["times"]
    errors = [abs(later - earlier - STEP_NS) / 1e6 for earlier, later in pairwise(times)]
    hundredths = statistics.quantiles(errors, n=100)
    figures = {"p50_ms": hundredths[49], "p99_ms": hundredths[98], "max_ms": max(errors)}
    bench.report(
        "timing at 1 kHz",
        figures,
        f"intervals differ by {figures['p50_ms']:.2f} ms (median), {figures['p99_ms']:.2f} ms (99th"
        f" percentile, below {TIMING_MS}), {figures['max_ms']:.2f} ms (most)",
        is_missed=figures["p99_ms"] >= TIMING_MS,
    )


def memory(bench: Bench) -> None:
    """Measure the memory of a recorder that goes on for long."""
    for name in bench.options.workload:
        with broker_process() as (url, _), bench.folder() as folder:
            found = bench.run(
                "record_long",
                folder,
                url=url,
                workload=name,
                gibibytes=bench.options.gibibytes,
                max_cache_size=bench.options.cache << 20,
            )
        samples: list[float] = found["samples"]
        start = len(samples) // 5
        growth = max(samples[start:]) - max(samples[: start + 1])
        most = max(samples) - found["before"]
        limit = bench.options.cache + SPARE_MIB
        bench.report(
            f"memory, {name}",
            {**found, "growth_mib": growth, "most_mib": most},
            f"{bench.options.gibibytes:g} GiB, {found['messages']:,} messages in {len(samples)} s; each tenth"
            f" {[round(each) for each in samples[:: max(1, len(samples) // 10)]]} MiB; at most {most:.0f}"
            f" more than before ({limit} allowed), {growth:.1f} more after the first fifth",
            is_missed=most > limit or growth > SPARE_MIB,
        )


ROWS: dict[str, Callable[[Bench], None]] = {
    each.__name__: each for each in (record, play, info, timing, memory)
}


def main() -> int:
    """Measure, print, and return whether a target is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("row", nargs="*", choices=[*ROWS, []], help="default: all but memory")
    parser.add_argument("--rounds", type=int, default=5, help="rounds of each workload; default: 5")
    parser.add_argument(
        "--workload", choices=WORKLOADS, action="append", help="may be repeated; default: all"
    )
    parser.add_argument(
        "--compression", choices=("none", "zstd", "lz4"), default="none", help="default: none"
    )
    parser.add_argument("--folder", type=Path, help="where files are written; default: the system's")
    parser.add_argument("--gibibytes", type=float, default=4, help="recorded for memory; default: 4")
    parser.add_argument("--cache", type=int, default=100, help="MiB, the recorder's for memory; default: 100")
    parser.add_argument("--json", type=Path, help="a file for the figures")
    options = parser.parse_args()
    options.workload = options.workload or list(WORKLOADS)
    bench = Bench(options)
    for row in options.row or [each for each in ROWS if each != "memory"]:
        ROWS[row](bench)
    if options.json:
        options.json.write_text(json.dumps(bench.figures, indent=1) + "\n", encoding="utf-8")
    return int(bool(bench.missed))


if __name__ == "__main__":
    sys.exit(main())
