"""Run rclpy 8.0's own tests with callboard's ROS face in its place: `make rclpy-tests`.

    git clone https://github.com/ros2/rclpy checkouts/rclpy
    make rclpy-tests UPSTREAM=checkouts

The tests come from the checkout's history, and the definitions and fixtures of test_msgs from real ROS 2 in
build/ros2. Nothing of either is copied here. As upstream runs them, each file has a process of its own.
`rclpy_listed.py` has the tests that need not pass, with the reasons; it fails if another one does not pass.
With `--real` real ROS 2 runs them, which shows what is fair to ask for.
"""

from __future__ import annotations

import argparse
import ast
import io
import os
import subprocess
import sys
import tarfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Final
from xml.etree import ElementTree as ET

import pytest

from tests.real_ros import REAL_PYTHON, ROOT
from tests.real_ros.sides import FOREIGN
from tests.upstream.rclpy_listed import LISTED, UNFAIR

COMMIT: Final = "ba72a017"
"""rclpy 8.0.0."""
FILE_TIMEOUT_SEC: Final = 600
TEST_TIMEOUT_SEC: Final = 60
FIXTURES: Final = "message_fixtures.py"
_LISTED: Final = frozenset(name for each in LISTED for name in each.names)
_ALLOWED: Final = _LISTED.union(UNFAIR.names)
PYTEST: Final = (
    *("-m", "pytest", "--quiet", "--tb=short", f"--timeout={TEST_TIMEOUT_SEC}"),
    *("-p", "pytest_timeout", "-p", "no:cacheprovider"),
)
"""The names of parameters must not depend on plugins that happen to be installed."""


def main() -> int:
    """Print how many tests pass; return 1 if one fails that is not listed."""
    parser = argparse.ArgumentParser(prog="python -m tests.upstream.rclpy_tests", description=__doc__)
    parser.add_argument("folder", type=Path, help="a folder with the checkout rclpy, or that checkout")
    parser.add_argument("--only", default="", metavar="NAME", help="files with this in their name")
    parser.add_argument("--jobs", type=int, default=2, help="files at the same time (default 2)")
    parser.add_argument("--real", action="store_true", help="run them with real ROS 2")
    options = parser.parse_args()
    checkout = options.folder / "rclpy" if (options.folder / "rclpy" / ".git").exists() else options.folder
    with TemporaryDirectory(prefix="callboard-rclpy-tests-") as work:
        side = _Real(Path(work)) if options.real else _Face(Path(work))
        side.unpack(checkout)
        names = [name for name in side.files() if options.only in name]
        try:
            with ThreadPoolExecutor(options.jobs) as pool:
                results = {test: why for each in pool.map(side.run, names) for test, why in each.items()}
        finally:
            side.close()
    return _report(results)


def _report(results: dict[str, str]) -> int:
    fair = {test: why for test, why in results.items() if _base(test) not in UNFAIR.names}
    passed = [test for test, why in fair.items() if not why]
    failed = [test for test, why in fair.items() if why and _base(test) not in _LISTED]
    for test in failed:
        print(f"failed   {test}: {fair[test]}")
    for test in passed:
        if _base(test) in _LISTED:
            print(f"passes   {test}, which is listed")
    listed = len(fair) - len(passed) - len(failed)
    print(f"{len(passed)} passed, {len(failed)} failed, {listed} listed, of {len(fair)}")
    return 1 if failed or not fair else 0


def _base(test: str) -> str:
    return test.partition("[")[0]


class _Face:
    """callboard's ROS face, with a broker.

    Args:
        work: An empty folder.
    """

    def __init__(self, work: Path) -> None:
        self._work = work
        self._own = {name: value for name, value in os.environ.items() if not name.startswith(FOREIGN)}
        command = (sys.executable, "-m", "broker", "--port", "0")
        self._broker = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self._broker.stdout is not None
        self._url = self._broker.stdout.readline().split()[-1]

    def close(self) -> None:
        """Stop the broker."""
        self._broker.terminate()
        self._broker.communicate()

    def unpack(self, checkout: Path) -> None:
        """Get the tests, and the package test_msgs with its fixtures.

        Raises:
            SystemExit: The folder has no such commit.
        """
        command = ("git", "-C", str(checkout), "archive", COMMIT, "rclpy/test")
        archive = subprocess.run(command, capture_output=True, check=False)
        if archive.returncode:
            raise SystemExit(f"{checkout} is no checkout of rclpy: {archive.stderr.decode()}")
        with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as source:
            source.extractall(self._work, filter="data")
        self._tests = self._work / "rclpy" / "test"
        (self._tests / "__init__.py").write_text("")  # upstream's looks for a built rclpy
        environment = REAL_PYTHON.parent.parent
        package = self._work / "site" / "test_msgs"
        copytree(environment / "share" / "test_msgs", package)
        fixtures = next(environment.glob(f"lib/python*/site-packages/test_msgs/{FIXTURES}"))
        (package / FIXTURES).write_bytes(fixtures.read_bytes())

    def files(self) -> list[str]:
        """Return the names of the files with tests."""
        return sorted(each.stem for each in self._tests.glob("test_*.py"))

    def run(self, name: str) -> dict[str, str]:
        """Run a file; return why each test has failed, "" if it has passed.

        A file with a failed test is run twice, as some of upstream's tests measure time.
        """
        results = self._run(name)
        if any(why and _base(test) not in _ALLOWED for test, why in results.items()):
            again = self._run(name)
            results = {test: why and again.get(test, why) for test, why in results.items()}
        return results

    def _run(self, name: str) -> dict[str, str]:
        report = self._work / f"{name}.xml"
        report.unlink(missing_ok=True)
        done = subprocess.run(
            (*self._command(), *PYTEST, f"--junit-xml={report}", f"test/{name}.py"),
            cwd=self._tests.parent,
            env={**self._own, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", **self._environ(name)},
            capture_output=True,
            check=False,
            timeout=FILE_TIMEOUT_SEC,
        )
        if not report.exists():
            return {name: f"pytest ended with {done.returncode}: {done.stdout[-2000:].decode()}"}
        results = dict(map(_result, ET.parse(report).iter("testcase")))
        if f"test.{name}" in results:  # an import has failed
            why = results[f"test.{name}"]
            functions = ast.walk(ast.parse((self._tests / f"{name}.py").read_bytes()))
            names = (each.name for each in functions if isinstance(each, ast.FunctionDef))
            return {f"{name}.{each}": why for each in names if each.startswith("test_")}
        return results

    def _command(self) -> tuple[str, ...]:
        return (sys.executable, "-m", "actors.ros", "--no-broker")

    def _environ(self, name: str) -> dict[str, str]:
        domain = str(self.files().index(name))  # graphs of their own
        path = os.pathsep.join((str(self._work / "site"), str(ROOT)))
        return {"CALLBOARD_URL": self._url, "ROS_DOMAIN_ID": domain, "PYTHONPATH": path}


class _Real(_Face):
    """Real ROS 2, with the pytest of this process."""

    def _command(self) -> tuple[str, ...]:
        return (str(REAL_PYTHON),)

    def _environ(self, name: str) -> dict[str, str]:
        path = Path(pytest.__file__).parent.parent
        return {
            "ROS_DOMAIN_ID": str(self.files().index(name)),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_LOG_DIR": str(self._work / "log"),
            "PYTHONPATH": str(path),
        }


def _result(case: ET.Element) -> tuple[str, str]:
    name = ".".join(filter(None, (case.get("classname", "").removeprefix("test."), case.get("name"))))
    wrong = case.find("failure")
    wrong = case.find("error") if wrong is None else wrong
    return name, "" if wrong is None else (wrong.get("message") or "failed").splitlines()[0]


if __name__ == "__main__":
    sys.exit(main())
