"""Run the tests of packages written for rclpy, with callboard's face in its place: `make judges`.

Their source distributions come from the package index into build/judges, with callboard in an environment of
its own. Nothing of them is copied here.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

ROOT: Final = Path(__file__).resolve().parent.parent.parent
WORK: Final = ROOT / "build" / "judges"
TIMEOUT_SEC: Final = 1800
TOOLS: Final = ("pytest", "pytest-asyncio", "pytest-benchmark", "pytest-timeout", "httpx", "hypothesis")


@dataclass(frozen=True)
class Judge:
    """A source distribution.

    Attributes:
        requirement: What pip downloads.
        passes: How many of its tests pass, at least; those that are expected to fail count.
        arguments: Arguments of its pytest.
    """

    requirement: str
    passes: int
    arguments: tuple[str, ...]


JUDGES: Final = (
    Judge("ros2-http-gateway==0.2.0", 815, ("test", "--timeout=60")),
    # Without launch tests, and the options for tools that it need not have here.
    Judge(
        "ros2-easy-test==0.2.0.post1",
        30,
        ("tests", "--override-ini=addopts=", "-k", "not launch and not Launch", "--timeout=120"),
    ),
)


def main() -> int:
    """Print how many tests pass; return 1 if they are fewer than before."""
    python = environment()
    return max(_judge(each, python) for each in JUDGES)


def environment(*requirements: str) -> Path:
    """Return the interpreter of an environment with callboard, the tools, and further packages."""
    python = WORK / "bin" / "python"
    if not python.exists():
        _run(sys.executable, "-m", "venv", str(WORK))
    own = ("--editable", str(ROOT), str(ROOT / "packaging" / "callboard-ros"))
    _run(str(python), "-m", "pip", "install", "--quiet", *TOOLS, *requirements, *own)
    return python


def unpacked(requirement: str, python: Path) -> Path:
    """Return the folder with a source distribution, which is downloaded.

    Args:
        requirement: What pip downloads.
        python: The interpreter whose pip does it.
    """
    folder = WORK / requirement
    pip = (str(python), "-m", "pip")
    _run(
        *pip,
        "download",
        "--quiet",
        "--no-deps",
        "--no-binary=:all:",
        "--dest",
        str(folder),
        requirement,
    )
    archive = next(folder.glob("*.tar.gz"))
    with tarfile.open(archive) as source:
        source.extractall(folder, filter="data")
    return folder / archive.name.removesuffix(".tar.gz")


def _judge(judge: Judge, python: Path) -> int:
    folder = unpacked(judge.requirement, python)
    _run(str(python), "-m", "pip", "install", "--quiet", str(folder))
    return run_tests(python, judge, folder, folder.parent / "report.xml")


def run_tests(python: Path, judge: Judge, folder: Path, report: Path, paths: tuple[Path, ...] = ()) -> int:
    """Run tests in a folder, and print how many pass; return 1 if they are fewer than before.

    Args:
        python: The interpreter.
        judge: What is expected.
        folder: Where pytest runs.
        report: The file for its report.
        paths: What the programs also import from.
    """
    report.unlink(missing_ok=True)  # pytest may end without one
    command = (str(python), "-m", "actors.ros", "-m", "pytest", "-q", "--tb=short", f"--junit-xml={report}")
    path = os.pathsep.join(map(str, (*paths, ROOT / "tests" / "interfaces")))  # with test_msgs
    _run("env", f"PYTHONPATH={path}", *command, *judge.arguments, folder=folder, check=False)
    cases = list(ET.parse(report).iter("testcase"))
    failed = [
        f"{case.get('classname')}.{case.get('name')}"
        for case in cases
        if case.find("failure") is not None or case.find("error") is not None
    ]
    passed = len(cases) - len(failed) - sum(_is_skipped(case) for case in cases)
    print(*(f"failed   {each}" for each in failed), sep="\n")
    print(f"{judge.requirement}: {passed} of {len(cases)} pass, expected at least {judge.passes}")
    return int(passed < judge.passes)


def _is_skipped(case: ET.Element) -> bool:
    """Return whether a test has not run. One that is expected to fail has."""
    skipped = case.find("skipped")
    return skipped is not None and skipped.get("type") != "pytest.xfail"


def _run(*command: str, folder: Path = ROOT, check: bool = True) -> None:
    subprocess.run(command, cwd=folder, check=check, timeout=TIMEOUT_SEC)


if __name__ == "__main__":
    sys.exit(main())
