"""`callboard bridge`: what it prints of bridges, and its options; tests/ros2 has the bridge itself."""

from __future__ import annotations

import contextlib
import json
from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.counters import Counters
from actors.bridges.report import Reason, Refusal
from actors.cli.commands.bridge import info
from actors.cli.main import main
from actors.interfaces.std_srvs.srv import Trigger
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.cli.conftest import Desk

FACTS: dict[str, Any] = {
    "network": "ros2/7",
    "id": "b1",
    "active": True,
    "waits_for": "",
    "rmw": "rmw_fastrtps_cpp",
    "distribution": "wheels",
    "has_own_profile": True,
    "refused_by_broker": [],
    "shown": {"callboard": {"nodes": 2, "endpoints": 9}, "ros2": {"nodes": 1, "endpoints": 3}},
}


@pytest.fixture(autouse=True)
def _rates_need_no_second(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(info, "RATE_SEC", 0.01)


async def information(desk: Desk, counters: Counters, **facts: Any) -> str:
    """Return what is printed about a bridge with these counters."""

    def report(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = json.dumps({**FACTS, **counters.document(), **facts})
        return response

    async with desk.node("bridge", labels={"bridge": "ros2/7", "bridge_id": "b1"}) as bridge:
        bridge.create_service(Trigger, "~/get_report", report)
        ended = await desk.callboard("bridge", "info")
        assert (ended.code, ended.err) == (0, "")
        documents = (await desk.callboard("bridge", "info", "--json")).json
        assert [each["node"] for each in documents] == ["/bridge"]
        return ended.out


async def test_the_counts_of_a_bridge(desk: Desk) -> None:
    """Both sides, what has crossed, and what has not with its reason."""
    counters = Counters()
    counters.topic("/battery", "std_msgs/msg/Float64", from_theirs=True)
    pose = counters.topic("/pose", "geometry_msgs/msg/Pose", from_theirs=False)
    pose.received, pose.sent, pose.lost = 5, 3, 1
    pose.drop("invalid", "a string with NUL", 2)
    lights = counters.service("/lights", from_theirs=True)
    lights.received = lights.sent = 1
    refusal = Refusal("/map", Reason.TYPE_MISSING, "ROS 2 has no type a/msg/Map", "a/msg/Map")
    counters.refuse((refusal, refusal._replace(name="/silent", quiet=True)))
    counters.failed("ROS 2 refuses /x")
    refused = ["/robot1/cmd_vel: not allowed"]
    assert (
        await information(desk, counters, refused_by_broker=refused)
        == """\
/bridge: ros2/7, active
  ROS 2: wheels, rmw_fastrtps_cpp
  Nodes of ROS 2 here: 2, with 9 endpoints
  Nodes of callboard in ROS 2: 1, with 3 endpoints
  Topics:
    /pose to ROS 2: 5 received (0.0/s), 3 passed on, 1 lost, 2 dropped (invalid: a string with NUL)
    1 more not used yet
  Services:
    /lights served here: 1 received (0.0/s), 1 passed on
  Does not cross:
    /map: ROS 2 has no type a/msg/Map
    the broker refuses /robot1/cmd_vel: not allowed
    ROS 2 refuses /x
"""
    )


async def test_the_rates_of_a_bridge(desk: Desk) -> None:
    """They are those between two reports, also of a topic that has just appeared."""
    counters = Counters()

    def report(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = json.dumps({**FACTS, **counters.document()})
        counters.topic("/battery", "std_msgs/msg/Float64", from_theirs=True).received += 10
        counters.service("/idle", from_theirs=True)
        return response

    async with desk.node("bridge", labels={"bridge": "ros2/7", "bridge_id": "b1"}) as bridge:
        bridge.create_service(Trigger, "~/get_report", report)
        (document,) = (await desk.callboard("bridge", "info", "--json")).json
    assert document["topics"][0]["received_per_sec"] > 0
    assert document["services"][0]["received_per_sec"] == 0


async def test_a_bridge_that_waits_for_another_one(desk: Desk) -> None:
    """It is named, and nothing else crosses; a profile of the user's is mentioned."""
    facts: dict[str, Any] = {"active": False, "waits_for": "b0", "has_own_profile": False}
    lines = (await information(desk, Counters(), **facts)).splitlines()
    assert lines[0] == "/bridge: ros2/7, waits for bridge b0"
    assert "a killed bridge is shown there for its lease" in lines[2]
    assert len(lines) == 3


async def test_a_bridge_that_has_carried_nothing(desk: Desk) -> None:
    """Nothing has been refused, either."""
    assert (await information(desk, Counters())).endswith("  Does not cross: nothing that was tried\n")


async def test_other_bridges_are_shown_beside_one_without_a_report(desk: Desk) -> None:
    """One that fails, or is none, hides no other one; the command says so, and fails."""
    messages = {"good": json.dumps({**FACTS, **Counters().document()}), "odd": '{"topics": 7}', "none": "["}
    async with contextlib.AsyncExitStack() as stack:
        for name in (*messages, "fails"):
            labels = {"bridge": "ros2/7", "bridge_id": name}
            node = await stack.enter_async_context(desk.node(name, labels=labels))

            def report(_: Trigger.Request, response: Trigger.Response, name: str = name) -> Trigger.Response:
                response.message = messages[name]  # KeyError
                return response

            node.create_service(Trigger, "~/get_report", report)
        ended = await desk.callboard("bridge", "info")
    assert ended.out.startswith("/good: ros2/7, active\n")
    assert "the bridge /fails does not answer" in ended.err
    assert all(f"the bridge /{name} answers with something else" in ended.err for name in ("odd", "none"))
    assert ended.code == 1


async def test_a_bridge_that_starts(desk: Desk) -> None:
    """Its node is in the graph before it can report: that is waited for."""

    def report(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = json.dumps({**FACTS, **Counters().document()})
        return response

    async with desk.node("bridge", labels={"bridge": "ros2/7", "bridge_id": "b1"}) as bridge:
        command = desk.start("bridge", "info")
        watch = bridge.watch_graph()
        async for _ in watch:
            if watch.snapshot.count(EntryKind.CLIENT, "/bridge/get_report"):
                break
        bridge.create_service(Trigger, "~/get_report", report)
        ended = await command
    assert (ended.code, ended.err) == (0, "")


async def test_a_graph_without_a_bridge(desk: Desk) -> None:
    """The error says how to start one."""
    ended = await desk.callboard("bridge", "info")
    assert ended.code == 1
    assert ended.err == "there is no bridge in this graph; start one with: callboard bridge ros2\n"


def test_wrong_options_of_a_bridge(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are found before ROS 2 is needed, on the command line and in a file."""
    path = tmp_path / "bridge.toml"
    path.write_text("max_nodes = 0")
    for arguments, said in (
        (("--allow", "camera"), "allow: 'camera' is not a pattern"),
        (("--depth", "/camera"), "expected a pattern and a depth, such as /camera/**=1, not '/camera'"),
        (("--domain-id", "233"), "domain_id must be an integer from 0 to 232, not 233"),
        (("--config", str(path)), f"{path}: max_nodes must be an integer from 1 to 10000, not 0"),
    ):
        assert main(["bridge", "ros2", "--check", *arguments]) == 1
        captured = capsys.readouterr()
        assert captured.err.startswith(said)
        assert captured.out == ""
