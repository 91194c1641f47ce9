"""A small run of the benchmark of the bridge; speed is not checked."""

from __future__ import annotations

import asyncio
import json
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from tests.ros2.network import Network


async def test_messages_of_all_ways_are_measured(network: Network, tmp_path: Path) -> None:
    """The relay's, and those of the bridge in both directions."""
    file = tmp_path / "rows.json"
    options = ("--alone", "--rounds", "1", "--seconds", "0.1", "--domain-id", str(network.domain))
    command = (sys.executable, "benchmarks/bridge.py", "100 Hz", *options, "--json", str(file))
    process = network.process("benchmark", *command)
    assert await asyncio.to_thread(process.wait) == 0, process.output()
    [row] = json.loads(file.read_text())["rows"].values()
    assert row.keys() == {"relay", "to callboard", "to ROS"}
    assert all(figures["p50_us"][0] > 0 for figures in row.values())
