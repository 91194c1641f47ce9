"""Generated packages, as linters and type checkers see them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from actors.interfaces.generator import generate
from tests.actors.interfaces.definitions_of_each_kind import write_package
from tests.integration.conftest import ROOT


def test_generated_source_is_clean(tmp_path: Path) -> None:
    """Formatted, and accepted by ruff and mypy --strict."""
    out = tmp_path / "out"
    generate(write_package(tmp_path), out)
    tools = Path(sys.executable).parent
    for command in (
        ["ruff", "format", "--isolated", "--line-length=110", "--check", "."],
        # A long value is in one line, as the formatter leaves it.
        [
            *("ruff", "check", "--isolated", "--line-length=110", "--select=E,F,W,I,UP,B,RUF,TC"),
            *("--per-file-ignores=_long.py:E501", "."),
        ],
        [
            "mypy",
            "--strict",
            "--no-incremental",
            f"--cache-dir={tmp_path / 'cache'}",
            "--config-file=",
            "robot_test_msgs",
        ],
    ):
        if shutil.which(command[0], path=str(tools)) is None:
            pytest.skip(f"{command[0]} is not installed")
        done = subprocess.run(
            [tools / command[0], *command[1:]],
            cwd=out,
            env={**os.environ, "MYPYPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        # mypy also reports on what the package imports, and that is not this test's business.
        clean = done.returncode == 0 or (command[0] == "mypy" and "robot_test_msgs" not in done.stdout)
        assert clean, done.stdout + done.stderr
