"""Run programs written for ROS 2 from checkouts of their collections, and compare them with the table.

    git clone https://github.com/ros2/examples checkouts/examples
    git clone https://github.com/ros2/demos checkouts/demos
    git clone https://github.com/ros2/ros2cli checkouts/ros2cli
    git clone https://github.com/ros2/rosidl checkouts/rosidl
    make upstream UPSTREAM=checkouts

The packages are installed with pip into a temporary folder; each scenario has a broker of its own.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.upstream import demos, examples, ros2cli
from tests.upstream.packages import Packages
from tests.upstream.runner import Runner, worst


def main() -> int:
    """Print what has happened; return 1 if a program does not behave as upstream."""
    parser = argparse.ArgumentParser(prog="python -m tests.upstream", description=__doc__)
    parser.add_argument("folder", type=Path, help="a folder with the checkouts")
    parser.add_argument("--only", default="", metavar="NAME", help="scenarios with this in a program's name")
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the verdicts there, with outputs"
    )
    parser.add_argument("--jobs", type=int, default=3, help="scenarios at the same time (default 3)")
    options = parser.parse_args()
    chosen = [
        each
        for each in (*examples.SCENARIOS, *demos.SCENARIOS, *ros2cli.SCENARIOS)
        if any(options.only in run.name for run in each)
    ]
    wanted = {run.package for scenario in chosen for run in scenario if run.is_upstream}
    with TemporaryDirectory(prefix="callboard-upstream-") as folder:
        packages = Packages(options.folder, Path(folder))
        uses_ros2cli = ros2cli.PACKAGE in wanted and packages.has(ros2cli.PACKAGE)
        missing = packages.install(wanted | (ros2cli.PARTS if uses_ros2cli else set()))
        if uses_ros2cli:
            packages.install_requirements(ros2cli.REQUIREMENTS)
            packages.copy("rosidl_adapter")
        present = [each for each in chosen if not missing & {run.package for run in each}]
        runner = Runner(packages, options.jobs)
        verdicts = worst(asyncio.run(runner.run_all(present)))
    for verdict in verdicts:
        print(verdict)
    for package in sorted(missing):
        print(f"{'missing':8} {package}: not in {options.folder}")
    for collection, commit in packages.collections():
        own = [each for each in verdicts if packages.collection(each.package) == collection]
        if own:
            same = sum(each.kind == "same" for each in own)
            print(f"{collection} at {commit}: {same} of {len(own)} programs behave as upstream")
    if options.json:
        commits = dict(packages.collections())
        programs = [{**asdict(each), "collection": packages.collection(each.package)} for each in verdicts]
        options.json.write_text(json.dumps({"commits": commits, "programs": programs}, indent=1) + "\n")
    return 0 if verdicts and all(each.kind == "same" for each in verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
