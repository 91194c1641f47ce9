"""The bridge as a user of the example rules in deploy/."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING

import actors
from actors.cli.main import main
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.real_ros import ROOT
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.ros2.network import Network

LATCHED = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def test_the_example_user_of_the_bridge_has_the_rights_that_it_needs(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below its namespace all crosses but what the rules deny; that is named in the bridge's report."""
    rules = tmp_path / "rules.toml"
    shutil.copy(ROOT / "deploy" / "rules.toml", rules)
    for user in ("bridge1", "operator"):
        token = str(tmp_path / f"{user}.token")
        assert main(["auth", "token", user, "--token-file", token, "--file", str(rules)]) == 0
        monkeypatch.setenv("CALLBOARD_TOKEN_FILE", token)
        if user == "bridge1":
            network.bridge("--namespace", "/robot1")
    network.broker("--auth", str(rules))
    there = await network.ros().node("driver")
    pose = await there.publisher("/pose", String)
    await there.publisher("/cmd_vel", String)
    heard = await there.subscription("/goal", String, LATCHED)
    received: list[str] = []
    async with actors.Node("pilot", url=network.url) as pilot:
        pilot.create_subscription(String, "/robot1/pose", lambda each: received.append(each.data), 10)
        goal = pilot.create_publisher(String, "/robot1/goal", LATCHED)
        await pose.matched()
        await pose.publish(String(data="here"))
        await until(lambda: received == ["here"], "the message of ROS 2")
        goal.publish(String(data="there"))
        assert await heard.received(1) == [String(data="there")]
        labels = (await pilot.get_graph()).node_labels()
        (bridge,) = [
            name for name, each in labels.items() if "bridge_id" in each and "bridge_state" not in each
        ]
        client = pilot.create_client(Trigger, f"{bridge}/get_report")
        assert await client.wait_for_service()
        report = json.loads((await client.call(Trigger.Request())).message)
    (refused,) = report["refused_by_broker"]
    assert "do not allow 'bridge1' to publish on '/robot1/cmd_vel'" in refused
