"""ARCHITECTURE.md names the files that an operation really enters."""

from __future__ import annotations

import subprocess
import sys

from tests.ways import ROOT


def test_the_architecture_describes_the_ways_as_they_are() -> None:
    """After a change of a way: python -m tests.ways --files."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.ways", "--check"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
