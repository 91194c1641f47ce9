"""Programs that are run without uvloop, and roles whose parent goes away."""

from __future__ import annotations

import json
import subprocess
import sys


def test_a_module_runs_without_uvloop() -> None:
    """The module is the program, with its own arguments, and uvloop cannot be imported."""
    statement = "import importlib.util as u, sys; assert sys.modules['uvloop'] is None"
    done = subprocess.run(
        [sys.executable, "-m", "actors.bench.plain_loop", "timeit", "-n", "1", "-r", "1", statement],
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert done.returncode == 0, done.stderr
    assert "1 loop" in done.stdout


def test_a_role_ends_when_its_parent_is_gone() -> None:
    """Without figures, and with an exit code that says so."""
    parameters = {
        "role": "pacer",
        "url": "callboard://127.0.0.1:9",
        "per_second": 1,
        "seconds": 1,
        "filling": 1,
    }
    done = subprocess.run(
        [sys.executable, "-m", "actors.bench", json.dumps(parameters)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert done.returncode == 1
    assert "done" not in done.stdout
    assert "Traceback" not in done.stderr
