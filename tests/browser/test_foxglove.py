"""Foxglove's own client at callboard's server; `node` runs it, without a browser."""

from __future__ import annotations

import asyncio
import json
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.nav_msgs.msg import OccupancyGrid
from actors.interfaces.std_msgs.msg import String
from actors.web.options import WebOptions
from tests.actors.meeting import DEADLINE_SEC, Meeting, latched
from tests.actors.web.site import Site
from tests.integration.conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

CLIENT: Final = ROOT / "tests" / "browser" / "foxglove_client.mjs"


async def run_client(address: str) -> dict[str, Any]:
    """Run the client; return what it has printed."""
    process = await asyncio.create_subprocess_exec(
        *("node", "--input-type=module", "-", address),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        cwd=ROOT / "build" / "npm",
    )
    try:
        async with asyncio.timeout(2 * DEADLINE_SEC):
            output, _ = await process.communicate(await asyncio.to_thread(CLIENT.read_bytes))
    except TimeoutError:
        process.kill()
        raise
    assert process.returncode == 0
    return {each["what"]: each["value"] for each in map(json.loads, output.splitlines())}


async def test_foxglove_looks_and_controls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Topics, publishing, a call, parameters, the graph and a file, in the words of Foxglove's own client."""
    share = tmp_path / "share" / "robot"
    share.mkdir(parents=True)
    (share / "package.xml").write_text("<package/>")
    (share / "shape.stl").write_text("solid")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    options = WebOptions(port=0, page=False, tools=("foxglove",), allow_control=True)
    async with AsyncExitStack() as stack:
        meeting = Meeting(stack)
        await meeting.open()
        stack.push_async_callback(meeting.stop_broker)
        node = await meeting.node("robot", start_parameter_services=True)
        node.declare_parameter("speed", 2.0)
        node.declare_parameter("name", "r2")
        grid = OccupancyGrid(data=[0, 100, -1])
        grid.header.frame_id = "map"
        node.create_publisher(OccupancyGrid, "map", latched(1)).publish(grid)
        for name in ("json", "cdr"):
            echo = node.create_publisher(String, f"{name}_echo", latched(1))
            node.create_subscription(String, name, echo.publish, 10)
        node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response(sum=request.a + request.b))
        site = await Site(stack, meeting, options).open()
        found = await run_client(site.server.tool_url("foxglove"))
    assert {"clientPublish", "services", "parameters", "assets"} <= {*found["info"]["capabilities"]}
    assert found["map"]["header"]["frame_id"] == "map"
    assert found["map"]["data"] == [0, 100, -1]
    assert found["sum"] == {"sum": "42"}
    assert found["json"] == {"data": "as json"}
    assert found["cdr"] == {"data": "as cdr"}
    assert found["parameters"] == [
        {"name": "/robot.speed", "value": 2, "type": "float64"},
        {"name": "/robot.name", "value": "r2"},
    ]
    assert found["set"] == found["changed"] == [{"name": "/robot.speed", "value": 3, "type": "float64"}]
    assert {"name": "/map", "publisherIds": ["/robot"]} in found["graph"]["publishedTopics"]
    assert found["asset"]["data"] == "solid"
    assert found["status"]["message"] == "There is no channel 4000000000"
    assert found["errors"] == []
