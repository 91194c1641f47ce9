"""The bridge as a user of the example rules in deploy/."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

import actors
from actors.cli.main import main
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.real_ros import ROOT
from tests.ros2.graphs import report_until
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.ros2.network import Network

LATCHED = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


MORE_DENIED = """
[roles.more]
deny.subscribe = ["/robot1/secret"]
deny.serve = ["/robot1/lights"]
deny.call = ["/robot1/dock"]
"""


async def test_the_example_user_of_the_bridge_has_the_rights_that_it_needs(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below its namespace all crosses but what is denied; that is named in the bridge's report, both ways."""
    rules = tmp_path / "rules.toml"
    example = (ROOT / "deploy" / "rules.toml").read_text()
    rules.write_text(example.replace('["bridge1", "node"]', '["bridge1", "node", "more"]') + MORE_DENIED)
    for user in ("operator", "bridge1"):
        token = tmp_path / f"{user}.token"
        assert main(["auth", "token", user, "--token-file", str(token), "--file", str(rules)]) == 0
        monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(token))
    bridge = network.bridge("--namespace", "/robot1")
    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(tmp_path / "operator.token"))
    broker = network.broker("--auth", str(rules))
    there = await network.ros().node("driver")
    pose = await there.publisher("/pose", String)
    await there.publisher("/cmd_vel", String)
    heard = await there.subscription("/goal", String, LATCHED)
    await there.subscription("/secret", String)
    await there.service("/lights", Trigger, Trigger.Response())
    await there.service("/horn", Trigger, Trigger.Response(success=True))
    docking = await there.client("/dock", Trigger)
    charging = await there.client("/charge", Trigger)
    received: list[str] = []
    async with actors.Node("pilot", url=network.url) as pilot:
        pilot.create_subscription(String, "/robot1/pose", lambda each: received.append(each.data), 10)
        goal = pilot.create_publisher(String, "/robot1/goal", LATCHED)
        pilot.create_publisher(String, "/robot1/secret", LATCHED).publish(String(data="secret"))
        for name in ("/robot1/dock", "/robot1/charge"):
            pilot.create_service(Trigger, name, lambda _, response: response)
        lights, horn = (pilot.create_client(Trigger, f"/robot1/{name}") for name in ("lights", "horn"))
        await pose.matched()
        await pose.publish(String(data="here"))
        await until(lambda: received == ["here"], "the message of ROS 2")
        goal.publish(String(data="there"))
        assert await heard.received(1) == [String(data="there")]
        assert await horn.wait_for_service()
        assert (await horn.call(Trigger.Request())).success
        assert not lights.service_is_ready()
        await charging.call(Trigger.Request())
        assert await docking.is_ready()  # it exists; that it may not be called is known in callboard only
        report = await report_until(pilot, lambda report: len(report["refused_by_broker"]) == len(DENIED))
        for text in DENIED:
            assert any(f"do not allow 'bridge1' to {text}" in each for each in report["refused_by_broker"])
        assert not any(each["reason"] == "not seen" for each in report["refusals"])
        # A reload takes the right to see away: nothing is left to be shown in ROS 2, and the report says why.
        example = rules.read_text()
        section = example.index("[roles.bridge1]")
        place = example.index('allow.see = ["/**"]', section)
        rules.write_text(example[:place] + example[place:].replace('allow.see = ["/**"]', "", 1))
        broker.send_signal(signal.SIGHUP)
        await there.node_names(absent=["/pilot"])
        report = await report_until(pilot, lambda report: report["shown"]["ros2"]["nodes"] == 0)
        (hidden,) = [each for each in report["refusals"] if each["reason"] == "not seen"]
        assert "'bridge1'" in hidden["text"]
        assert (await horn.call(Trigger.Request())).success
    assert bridge.output().count("allow.see") == 1


DENIED = (
    "publish on '/robot1/cmd_vel'",
    "subscribe to '/robot1/secret'",
    "serve '/robot1/lights'",
    "call '/robot1/dock'",
)
