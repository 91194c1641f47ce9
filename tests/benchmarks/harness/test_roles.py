"""Roles whose parent goes away, and the pace of a publisher."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any, cast

import pytest

from benchmarks.harness.roles.stream import publisher
from broker import Broker, BrokerOptions


@pytest.mark.processes
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


class Ready:
    """A parent that lets its role begin at once."""

    async def ready(self) -> None:
        """Return."""


async def test_a_publisher_keeps_its_pace() -> None:
    """It sends no more than is due, however late the machine lets it run."""
    pace = {"seconds": 0.1, "size": 256, "burst": 1, "mb_s": 500 * 256 / 1e6}
    async with Broker(BrokerOptions(port=0)) as running:
        found = await publisher({**pace, "url": running.url, "readers": 0}, cast("Any", Ready()))
    assert 1 <= found["sent"] <= 500 * 0.1 + 2
