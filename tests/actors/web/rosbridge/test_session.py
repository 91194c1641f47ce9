"""What a client of rosbridge may do, and what it hears when it does something else."""

from __future__ import annotations

import json
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import aiohttp
import cbor2
import pytest

from actors.interfaces.cdr.codec import decode as decode_cdr
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Int32, String
from actors.web.options import WebOptions
from tests.actors.meeting import latched
from tests.actors.web.rosbridge.bridge import Bridge

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


@pytest.mark.parametrize(
    ("op", "fields", "text"),
    [
        ("publish", {"topic": "/nothing", "msg": {}}, "does not say of which type"),
        ("publish", {"topic": "/number", "msg": {"data": "x"}}, "Int32.data"),
        ("publish", {"topic": "/number", "msg": {"color": 1}}, "no field 'color'"),
        ("advertise", {"topic": "/a", "type": "std_msgs/Nothing"}, "Nothing"),
        ("advertise", {"topic": "/number", "type": "std_msgs/String"}, "has the type std_msgs/msg/Int32"),
        ("advertise", {"topic": "/not a name", "type": "std_msgs/String"}, "not a name"),
        ("advertise", {"topic": "/a", "type": "os/system"}, "os/msg/system"),
        ("unadvertise", {"topic": "/a"}, "has not advertised"),
        ("subscribe", {"topic": "/number", "type": "std_msgs/String"}, "has the type std_msgs/msg/Int32"),
        ("subscribe", {"topic": "/not a name"}, "not a name"),
        ("unsubscribe", {"topic": "/a"}, "no subscription"),
        ("dance", {}, "Unknown operation 'dance'"),
    ],
)
async def test_errors_have_the_id_of_their_operation(
    bridge: Bridge, meeting: Meeting, op: str, fields: dict[str, Any], text: str
) -> None:
    """They are status messages, and the client goes on."""
    node = await meeting.node("counter")
    node.create_subscription(Int32, "/number", lambda _: None, 10)
    client = await bridge.connect()
    await client.send(op, id="x", **fields)
    status = await client.next()
    assert (status["op"], status["level"], status["id"]) == ("status", "error", "x")
    assert text in status["msg"]
    await client.settled()


async def test_a_client_chooses_the_level_of_status_messages(bridge: Bridge) -> None:
    """None, for example."""
    client = await bridge.connect()
    await client.send("set_level", level="none")
    await client.send("unadvertise", topic="/a")
    await client.settled()
    await client.send("set_level", level="warning")
    await client.send("unadvertise", id=1, topic="/a")
    assert (await client.next())["id"] == 1


async def test_a_client_that_may_only_read(read_only: Bridge, meeting: Meeting) -> None:
    """Reads topics and asks about the graph; everything else is refused, and says how it is allowed."""
    node = await meeting.node("talker")
    node.create_publisher(String, "/chatter", latched(1)).publish(String(data="hello"))
    client = await read_only.connect()
    await client.send("subscribe", topic="/chatter")
    assert (await client.next())["msg"] == {"data": "hello"}
    await client.send("publish", topic="/chatter", msg={"data": "no"})
    assert "--allow-control" in (await client.next())["msg"]
    assert "--allow-control" in (await client.call("/add", {}))["values"]
    await client.send("send_action_goal", id=1, action="/a", action_type="a/B")
    assert "--allow-control" in (await client.next())["values"]
    graph = await node.get_graph()
    assert "/rosbridge_websocket" not in graph.nodes()


async def test_parts_of_an_operation(bridge: Bridge) -> None:
    """Are put together; a fragment in fragments is an error."""
    client = await bridge.connect()
    text = json.dumps({"op": "unadvertise", "id": "whole", "topic": "/a"})
    for number in (1, 0):
        await client.send(
            "fragment", id="a", data=text[number * 20 :][: 20 if not number else None], num=number, total=2
        )
    assert (await client.next())["id"] == "whole"
    nested = json.dumps({"op": "fragment", "id": "b", "data": "", "num": 0, "total": 1})
    await client.send("fragment", id="a", data=nested, num=0, total=1)
    assert "cannot be in fragments" in (await client.next())["msg"]


async def test_large_messages_are_sent_in_fragments_to_those_who_ask(
    bridge: Bridge, meeting: Meeting
) -> None:
    """Each message with an id of its own; responses, too. What is small enough is sent as it is."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "/chatter", latched(2))
    for text in ("a", "b"):
        publisher.publish(String(data=text * 100))
    client = await bridge.connect()
    await client.send("subscribe", topic="/chatter", fragment_size=50)
    whole: list[dict[str, Any]] = []
    ids: set[str] = set()
    while len(whole) < 2:
        parts = [await client.next()]
        while len(parts) < parts[0]["total"]:
            parts.append(await client.next())
        assert len({each["id"] for each in parts}) == 1
        ids.add(parts[0]["id"])
        whole.append(json.loads("".join(each["data"] for each in parts)))
    assert [each["msg"]["data"][0] for each in whole] == ["a", "b"]
    assert len(ids) == 2
    await client.send("call_service", id="w", service="/rosapi/get_ros_version", fragment_size=1000)
    assert (await client.next())["id"] == "w"
    await client.send("call_service", id="x", service="/rosapi/topics", fragment_size=50)
    assert (await client.next())["op"] == "fragment"


@pytest.mark.parametrize("compression", ["cbor", "cbor-raw"])
async def test_binary_frames_for_those_who_ask(bridge: Bridge, meeting: Meeting, compression: str) -> None:
    """Also while another client of the topic gets JSON."""
    node = await meeting.node("talker")
    scan = LaserScan(ranges=[1.0, 2.0])
    node.create_publisher(LaserScan, "/scan", latched(1)).publish(scan)
    binary, text = await bridge.connect(), await bridge.connect()
    await binary.send("subscribe", topic="scan", compression=compression)
    await text.send("subscribe", topic="scan")
    found = cbor2.loads(await binary.next_bytes())
    assert (found["op"], found["topic"]) == ("publish", "scan")
    if compression == "cbor":
        assert found["msg"]["ranges"].tag == 85
    else:
        assert decode_cdr(LaserScan, found["msg"]["bytes"]) == scan
        assert found["msg"]["secs"] > 0
    assert (await text.next())["msg"]["ranges"] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {"Origin": "http://evil.example"}, 403),
        ("/", {"Origin": "null"}, 403),
        ("/?token=0123456789abcdef", {"Origin": "http://evil.example"}, 403),
        ("/", {"Host": "evil.example"}, 421),
        ("/", {"Origin": "https://tools.example"}, None),
        ("/", {}, None),
        ("/rosbridge", {}, None),
        ("/other", {}, 404),
    ],
)
async def test_who_may_connect(
    meeting: Meeting, path: str, headers: dict[str, str], status: int | None
) -> None:
    """Programs, and pages of this server and of sites that are allowed."""
    async with AsyncExitStack() as stack:
        options = WebOptions(
            port=0, page=False, tools=("rosbridge",), token="0123456789abcdef",
            allowed_origins=("https://tools.example",),
        )  # fmt: skip
        bridge = await Bridge(stack, meeting, options).open()
        if status is None:
            await (await bridge.connect(path, headers=headers)).settled()
        else:
            with pytest.raises(aiohttp.WSServerHandshakeError) as caught:
                await bridge.connect(path, headers=headers)
            assert caught.value.status == status
