"""The bridges that `callboard broker --bridge ros2` and launch files start."""

from __future__ import annotations

import os
import re
import signal
from typing import TYPE_CHECKING

import actors
from actors.cli.main import main
from tests.real_ros import REAL_PYTHON
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.ros2.network import Network


async def test_the_bridge_runs_beside_the_broker_and_ends_with_it(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With options from a file, as the user of its token; after a crash it is started again."""
    (tmp_path / "bridge.toml").write_text(f'domain_id = {network.domain}\nnamespace = "/robot1"\n')
    rules = str(tmp_path / "access.toml")
    tokens = {user: str(tmp_path / f"{user}.token") for user in ("bridge", "zoe")}
    for user, token in tokens.items():
        assert main(["auth", "add", user, "--role", "full", "--token-file", token, "--file", rules]) == 0
    options = {"port": network.url.rpartition(":")[2], "auth": rules, "bridge": "ros2"}
    options |= {"bridge-config": str(tmp_path / "bridge.toml"), "bridge-token": tokens["bridge"]}
    flags = [word for name, value in options.items() for word in (f"--{name}", value)]
    broker = network.process(
        "broker",
        *(str(REAL_PYTHON), "-m", "actors", "broker", "--insecure", *flags),
        CALLBOARD_TOKEN_FILE=str(tmp_path / "absent.token"),
    )
    await network.ros().node("talker")
    output = ""

    def started() -> list[str]:
        nonlocal output
        output += broker.output()
        return re.findall(r"Child 'bridge' started with pid ([0-9]+)", output)

    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", tokens["zoe"])
    async with actors.Node("zoe", url=network.url) as node:
        assert await node.wait_for_node("/robot1/talker")
        (first,) = started()
        os.kill(int(first), signal.SIGKILL)
        await until(
            lambda: len(started()) == 2 and output.count("callboard bridge between") == 2,
            "a restart",
            deadline_sec=120.0,
        )
        assert await node.wait_for_node("/robot1/talker")
    assert broker.stop() == 0
    output += broker.output()
    assert "Traceback" not in output
    assert "Child 'bridge' ended: stopped by its supervisor" in output


async def test_a_launch_file_starts_a_bridge(network: Network, tmp_path: Path) -> None:
    """With the broker of the launch; its options are those of the command."""
    path = tmp_path / "robot.launch.yaml"
    path.write_text(f"launch:\n- ros_bridge: {{domain_id: {network.domain}, namespace: /robot1}}\n")
    launch = network.process("launch", str(REAL_PYTHON), "-m", "actors", "launch", str(path))
    await network.ros().node("talker")
    async with actors.Node("reader", url=network.url) as node:
        assert await node.wait_for_node("/robot1/talker")
    assert launch.stop() == 0
    output = launch.output()
    assert "[ros_bridge-1] callboard bridge between " in output
    assert "Traceback" not in output
