"""Run tests many times, beside busy processes if asked to, and list which failed how often.

    python -m tests.flakes --runs 20 --load 2 -- python -m pytest -n auto tests/integration

The output of run 3 is kept in build/flakes/3.log; its tests ran in the order of --randomly-seed=3.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

FOLDER: Final = Path("build/flakes")


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Keep as many cores busy while inside."""
    load = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in load:
            process.kill()
            process.wait()


def run(number: int, command: Sequence[str]) -> list[str]:
    """Run the tests once; return the names of those that failed, or how pytest ended if it failed itself."""
    report = FOLDER / f"{number}.xml"
    report.unlink(missing_ok=True)
    with (FOLDER / f"{number}.log").open("w") as log:
        options = [f"--junitxml={report}", f"--randomly-seed={number}"]
        code = subprocess.call([*command, *options], stdout=log, stderr=subprocess.STDOUT)
    cases = ET.parse(report).iter("testcase") if report.exists() else ()
    failed = {
        f"{case.get('classname')}::{case.get('name')}"
        for case in cases
        if case.find("failure") is not None or case.find("error") is not None
    }
    return sorted(failed) or ([f"pytest itself, with exit code {code}"] if code else [])


def main(argv: Sequence[str] | None = None) -> int:
    """Run all; return 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.flakes", description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="how many times")
    parser.add_argument("--load", type=int, default=0, help="busy processes beside the tests")
    parser.add_argument("command", nargs="+", help="how to run pytest")
    chosen = parser.parse_args(argv)
    FOLDER.mkdir(parents=True, exist_ok=True)
    failures: Counter[str] = Counter()
    with busy(chosen.load):
        for number in range(1, chosen.runs + 1):
            began = time.monotonic()
            failed = run(number, chosen.command)
            failures.update(failed)
            _print_line(
                f"run {number}: {len(failed)} failed in {time.monotonic() - began:.0f} s {failed or ''}"
            )
    for name, times in failures.most_common():
        _print_line(f"{times:4} of {chosen.runs}  {name}")
    return 1 if failures else 0


def _print_line(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main())
