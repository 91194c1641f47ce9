"""Type checkers compare a callback with the type of its subscription or service."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tests.actors.meeting import DEADLINE_SEC
from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Sequence

PROGRAM = Path(__file__).with_name("callback_types.py")


def lines_with_errors(text: str) -> list[int]:
    """Return the numbers of the lines with an error that mypy is to ignore."""
    return [number for number, line in enumerate(text.splitlines(), 1) if "type: ignore" in line]


def test_pyright_reports_callbacks_that_do_not_fit(tmp_path: Path) -> None:
    """Those, and no others. (mypy checks the file itself: an unused `type: ignore` is an error.)"""
    text = PROGRAM.read_text()
    (tmp_path / "program.py").write_text(text)
    options = {
        "extraPaths": [str(ROOT)],
        "pythonVersion": "3.11",
        "typeCheckingMode": "strict",
        "enableTypeIgnoreComments": False,
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(options))
    command = ["-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path)]
    found = diagnostics(command)
    assert found == lines_with_errors(text)


def diagnostics(command: Sequence[str]) -> list[int]:
    """Run pyright; return the lines with errors."""
    done = subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, check=False, timeout=DEADLINE_SEC
    )
    reported = json.loads(done.stdout)["generalDiagnostics"]
    return sorted({each["range"]["start"]["line"] + 1 for each in reported if each["severity"] == "error"})
