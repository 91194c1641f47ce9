"""The comparison of upstream's programs, with a checkout of our own that has one of their names."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import pytest

from tests.integration.guides import builds_packages
from tests.upstream.__main__ import main
from tests.upstream.runner import Verdict, worst

if TYPE_CHECKING:
    from pathlib import Path

PACKAGE = "examples_rclpy_guard_conditions"
SETUP = f"""
from setuptools import setup

setup(
    name="{PACKAGE}", version="0.0.0", packages=["{PACKAGE}"],
    entry_points={{"console_scripts": ["trigger_guard_condition = {PACKAGE}.program:main"]}},
)
"""
PROGRAM = """
import rclpy

def main():
    rclpy.init()
    node = rclpy.create_node("node")
    print("waiting, triggered guard, finished; waiting, guard callback")
"""


@builds_packages
@pytest.mark.parametrize(
    ("more", "verdict"),
    [
        ("    print('finished')", "same"),
        ("    raise SystemExit(3)", "differs"),
        ("    from rclpy.none import x", "cannot"),
    ],
)
def test_a_program_is_compared_with_the_table(
    more: str,
    verdict: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It is installed, run and compared; the exit code says whether all programs behave as upstream."""
    inside = tmp_path / "checkouts" / "examples" / PACKAGE / PACKAGE
    inside.mkdir(parents=True)
    (inside / "__init__.py").touch()
    (inside.parent / "setup.py").write_text(SETUP)
    (inside / "program.py").write_text(PROGRAM + more + "\n")
    options = (str(tmp_path / "checkouts"), "--only", PACKAGE, "--json", str(tmp_path / "json"))
    monkeypatch.setattr(sys, "argv", ["upstream", *options])
    assert main() == (verdict != "same")
    assert capsys.readouterr().out.startswith(f"{verdict:8} {PACKAGE} trigger_guard_condition")
    (program,) = json.loads((tmp_path / "json").read_text())["programs"]
    assert (program["kind"], program["collection"]) == (verdict, "examples")


def test_a_program_has_the_verdict_of_its_worst_run() -> None:
    """Some programs are in several scenarios."""
    runs = [Verdict("p", "x", kind) for kind in ("same", "cannot", "differs")]
    assert worst([*runs, Verdict("p", "a", "same")]) == [Verdict("p", "a", "same"), runs[1]]
