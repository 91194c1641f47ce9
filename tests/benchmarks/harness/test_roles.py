"""Roles whose parent goes away."""

from __future__ import annotations

import json
import subprocess
import sys


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
        [sys.executable, "-m", "benchmarks.harness", json.dumps(parameters)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert done.returncode == 1
    assert "done" not in done.stdout
    assert "Traceback" not in done.stderr
