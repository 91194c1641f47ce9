"""Foxglove's clients at a server with a graph."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import aiohttp
import pytest

from actors import Message
from actors.interfaces import cdr
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.definition_texts import definition_text
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.web import worker
from actors.web.foxglove import client as client_module
from actors.web.foxglove.catalogue import Catalogue
from actors.web.options import WebOptions
from actors.web.worker import TooMuchWorkError
from tests.actors.meeting import DEADLINE_SEC, latched, until
from tests.actors.web.foxglove.conftest import TOKEN
from tests.actors.web.foxglove.peer import SDK, Peer, values_in
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting


@pytest.mark.parametrize("subprotocol", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
async def test_a_topic_is_streamed(site: Site, meeting: Meeting, subprotocol: str) -> None:
    """As CDR, with its definition; both subprotocols are spoken."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(PoseStamped, "pose", 10)
    async with site.client.ws_connect("/", protocols=["other", subprotocol]) as socket:
        assert socket.protocol == subprotocol
        peer = Peer(socket)
        assert (await peer.text("serverInfo"))["name"].startswith("callboard ")
        number = await peer.subscribe("/pose")
        assert peer.channels["/pose"] == {
            "id": peer.channels["/pose"]["id"],
            "topic": "/pose",
            "encoding": "cdr",
            "schemaName": "geometry_msgs/msg/PoseStamped",
            "schema": definition_text(PoseStamped),
            "schemaEncoding": "ros2msg",
        }
        await publisher.wait_for_subscriptions()
        sent = PoseStamped()
        sent.pose.position.x = 1.5
        publisher.publish(sent)
        found = await peer.data()
        assert found.subscription_id == number
        assert found.payload == cdr.encode(sent)
        await peer.send("unsubscribe", subscriptionIds=[number])
        await until(lambda: not publisher.get_subscription_count())


@pytest.mark.parametrize("offered", [None, "graphql-ws", "foxglove.websocket.v2"])
async def test_another_subprotocol_is_refused(site: Site, offered: str | None) -> None:
    """With a text that names those which are spoken."""
    headers = {} if offered is None else {"Sec-WebSocket-Protocol": offered}
    document = await site.json("/", 400, headers={"Upgrade": "websocket", "Connection": "Upgrade", **headers})
    assert "foxglove.sdk.v1 and foxglove.websocket.v1" in document["error"]


async def test_latched_messages_come_at_once(peer: Peer, site: Site, meeting: Meeting) -> None:
    """Those of all publishers, for the first client of a topic and for the next."""
    for name in ("arm", "base"):
        node = await meeting.node(name)
        node.create_publisher(String, "description", latched(1)).publish(String(data=name))
    await peer.subscribe("/description")
    assert {(await peer.message(String)).data for _ in range(2)} == {"arm", "base"}
    async with site.client.ws_connect("/", protocols=[SDK]) as socket:
        other = Peer(socket)
        await other.subscribe("/description")
        assert {(await other.message(String)).data for _ in range(2)} == {"arm", "base"}


async def test_a_flood_does_not_lose_a_latched_message(
    peer: Peer, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client reads nothing while one topic floods: what another says once, and the newest, arrive."""
    monkeypatch.setattr(client_module, "DROPS_SEC", 0.01)
    node = await meeting.node("talker")
    flood = node.create_publisher(String, "flood", 10)
    rare = node.create_publisher(String, "rare", latched(1))
    await peer.subscribe("/flood")
    await peer.subscribe("/rare")
    await flood.wait_for_subscriptions()
    await rare.wait_for_subscriptions()
    text = "x" * 60_000
    for number in range(300):  # 18 MB: more than the kernel and the queue hold
        flood.publish(String(data=f"{number} {text}"))
        if number == 200:
            rare.publish(String(data="once"))
        await flood.flush()
    flood.publish(String(data="last"))
    seen = list[str]()
    while "last" not in seen:
        seen.append((await peer.message(String)).data.split(" ")[0])
    assert "once" in seen
    assert len(seen) < 302
    await peer.until(lambda: any("reads too slowly" in each for each in peer.statuses))


async def test_topics_appear_vanish_and_change_their_type(peer: Peer, meeting: Meeting) -> None:
    """Another type is another channel; the subscription to the old one has ended."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "data", 1)
    await peer.subscribe("/data")
    first = peer.channels["/data"]["id"]
    node.destroy_publisher(publisher)
    await peer.until(lambda: "/data" not in peer.channels)
    changed = node.create_publisher(Int32, "data", latched(1))
    changed.publish(Int32(data=5))
    await peer.subscribe("/data")
    assert peer.channels["/data"]["id"] != first
    assert peer.channels["/data"]["schemaName"] == "std_msgs/msg/Int32"
    assert (await peer.message(Int32)).data == 5
    node.destroy_publisher(changed)
    await peer.until(lambda: "/data" not in peer.channels)
    node.create_publisher(String, "data", 1)
    await peer.until(lambda: "/data" in peer.channels)
    assert peer.channels["/data"]["id"] == first


async def test_a_topic_with_two_types_is_two_channels(peer: Peer, meeting: Meeting) -> None:
    """Each has the messages of its type."""
    for name, cls in (("one", String), ("two", Int32)):
        node = await meeting.node(name)
        node.create_publisher(cls, "data", latched(1)).publish(cls())
    seen = set[str]()
    while len(seen) < 2:
        channels = (await peer.text("advertise"))["channels"]
        seen |= {each["schemaName"] for each in channels if each["topic"] == "/data"}
    assert seen == {"std_msgs/msg/String", "std_msgs/msg/Int32"}


class Custom(Message, type_name="foxglove_test_msgs/msg/Custom"):
    """A type that is defined in a program."""

    value: int = 0


async def test_types_that_are_not_installed_are_known_from_the_graph(peer: Peer, meeting: Meeting) -> None:
    """Their definition comes from their users."""
    node = await meeting.node("talker")
    node.create_publisher(Custom, "custom", latched(1)).publish(Custom(value=7))
    await peer.subscribe("/custom")
    assert peer.channels["/custom"]["schema"] == "int64 value\n"
    assert (await peer.message(Custom)).value == 7


async def test_a_thousand_topics_are_announced(peer: Peer, meeting: Meeting) -> None:
    """In some texts; all of them can be subscribed to at once."""
    node = await meeting.node("talker")
    publishers = [node.create_publisher(Int32, f"t{number}", latched(1)) for number in range(1000)]
    await peer.until(lambda: len(peer.channels) >= 1000)
    for number, publisher in enumerate(publishers):
        publisher.publish(Int32(data=number))
    items = [{"id": each["id"], "channelId": each["id"]} for each in peer.channels.values()]
    await peer.send("subscribe", subscriptions=items)
    seen = set[int]()
    while len(seen) < 1000:
        seen.add((await peer.message(Int32)).data)
    assert peer.statuses == []


async def test_what_cannot_be_cdr_is_reported(peer: Peer, meeting: Meeting) -> None:
    """A string with a NUL has no place in ROS 2; the next message arrives."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 10)
    await peer.subscribe("/chatter")
    await publisher.wait_for_subscriptions()
    publisher.publish(String(data="a\0b"))
    publisher.publish(String(data="c"))
    assert (await peer.message(String)).data == "c"
    await peer.until(lambda: any("'/chatter' is left out" in each for each in peer.statuses))


async def test_simulated_time(peer: Peer, site: Site, meeting: Meeting) -> None:
    """Times are those of the clock once it has told one, also for a client that comes later."""
    info = await peer.text("serverInfo")
    assert "time" not in info["capabilities"]
    node = await meeting.node("simulator")
    clock = node.create_publisher(Clock, "clock", 1)
    data = node.create_publisher(String, "chatter", 1)
    await peer.subscribe("/chatter")
    await clock.wait_for_subscriptions()
    await data.wait_for_subscriptions()
    before_ns = time.time_ns()
    data.publish(String())
    assert before_ns <= (await peer.data()).time_ns <= time.time_ns()
    clock.publish(Clock(clock=Time(sec=5, nanosec=6)))
    changed = await peer.text("serverInfo")
    assert "time" in changed["capabilities"]
    assert changed["sessionId"] != info["sessionId"]
    assert await peer.binary(2) == b"\x02" + (5_000_000_006).to_bytes(8, "little")
    data.publish(String())
    assert (await peer.data()).time_ns == 5_000_000_006
    async with site.client.ws_connect("/", protocols=[SDK]) as socket:
        late = Peer(socket)
        while "time" not in (await late.text("serverInfo"))["capabilities"]:
            pass
    node.destroy_publisher(clock)
    assert "time" not in (await peer.text("serverInfo"))["capabilities"]


@pytest.mark.parametrize("encoding", ["cdr", "json"])
async def test_clients_publish(peer: Peer, meeting: Meeting, encoding: str) -> None:
    """On a topic that has a subscription; the client sees its own messages, too."""
    node = await meeting.node("listener")
    received = list[str]()
    node.create_subscription(String, "chatter", lambda message: received.append(message.data), 10)
    await peer.until(lambda: "/chatter" in peer.channels)
    channel = {"id": 1, "topic": "/chatter", "encoding": encoding, "schemaName": "std_msgs/String"}
    await peer.send("advertise", channels=[channel])
    payload = cdr.encode(String(data="hi")) if encoding == "cdr" else b'{"data":"hi"}'
    await peer.socket.send_bytes(b"\x01\x01\0\0\0" + payload)
    await until(lambda: received == ["hi"])
    await peer.subscribe("/chatter")
    await peer.socket.send_bytes(b"\x01\x01\0\0\0" + b"\xff")
    await peer.until(lambda: any("'/chatter'" in each for each in peer.statuses))
    await peer.send("unadvertise", channelIds=[1])


async def test_clients_publish_new_topics(peer: Peer, meeting: Meeting) -> None:
    """Also of types that only they know, by the definition that they send; the topic becomes a channel."""
    channels = [
        {"id": 1, "topic": "/goal", "encoding": "json", "schemaName": "geometry_msgs/msg/PoseStamped"},
        {
            "id": 2,
            "topic": "/new",
            "encoding": "json",
            "schemaName": "some_msgs/New",
            "schema": "int32 a\nstd_msgs/Header header\n",
            "schemaEncoding": "ros2msg",
        },
        {"id": 3, "topic": "/unknown", "encoding": "json", "schemaName": "some_msgs/Unknown"},
        {"id": 4, "topic": "/a b", "encoding": "json", "schemaName": "std_msgs/String"},
    ]
    await peer.send("advertise", channels=channels)
    await peer.until(lambda: {"/goal", "/new"} <= peer.channels.keys() and len(peer.statuses) == 2)
    assert peer.channels["/new"]["schemaName"] == "some_msgs/msg/New"
    await peer.subscribe("/goal")
    received = list[Any]()
    node = await meeting.node("listener")
    subscription = node.create_subscription(PoseStamped, "goal", received.append, 10)
    await until(subscription.get_publisher_count)
    await peer.socket.send_bytes(b'\x01\x01\0\0\0{"pose":{"position":{"x":2}}}')
    await until(lambda: received)
    assert received[0].pose.position.x == 2.0
    assert (await peer.message(PoseStamped)).pose.position.x == 2.0


async def test_clients_call_services(peer: Peer, meeting: Meeting) -> None:
    """In both encodings; errors are answers."""
    node = await meeting.node("server")

    def fail(_: Trigger.Request) -> Trigger.Response:
        raise RuntimeError("broken")

    node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response(sum=request.a + request.b))
    node.create_service(Trigger, "fail", fail)
    answer = await peer.call("/add", "cdr", cdr.encode(AddTwoInts.Request(a=2, b=3)))
    assert isinstance(answer, bytes)
    assert cdr.decode(AddTwoInts.Response, answer).sum == 5
    assert await peer.call("/add", "json", b'{"a":4,"b":5}') == b'{"sum":9}'
    for service, payload, text in (
        ("/add", b'{"c":4}', "c"),
        ("/add", b"{", "JSON"),
        ("/fail", b"{}", "broken"),
    ):
        failure = await peer.call(service, "json", payload)
        assert isinstance(failure, dict)
        assert text in failure["message"]
    known = peer.services["/add"]
    assert known["type"] == "example_interfaces/srv/AddTwoInts"
    assert known["request"]["schema"] == "int64 a\nint64 b\n"
    assert known["response"]["schemaName"] == "example_interfaces/srv/AddTwoInts_Response"


async def test_parameters_are_read_and_set(peer: Peer, meeting: Meeting) -> None:
    """Of all nodes, with the types that JSON does not show; each is set, or refused, by itself."""
    node = await meeting.node("robot", start_parameter_services=True)
    values: dict[str, Any] = {
        "speed": 2.0,
        "name": "r",
        "ids": [1, 2],
        "raw": b"ab",
        "weights": [1.0, 2.0],
    }
    for name, value in values.items():
        node.declare_parameter(name, value)
    await peer.until(lambda: "/robot/get_parameters" in peer.services)
    everything = await peer.parameters()
    assert everything["/robot.speed"] == (2.0, "float64")
    assert everything["/robot.name"] == ("r", None)
    assert everything["/robot.ids"] == ([1, 2], None)
    assert everything["/robot.raw"] == ("YWI=", "byte_array")
    assert everything["/robot.weights"] == ([1.0, 2.0], "float64_array")
    items = [
        {"name": "/robot.speed", "value": 3},
        {"name": "/robot.ids", "value": None},
        {"name": "/robot.name", "value": 5},
        {"name": "/robot.raw", "value": "AAEC", "type": "byte_array"},
        {"name": "/robot.weights", "value": [3], "type": "float64_array"},
        {"name": "/nobody.a", "value": 1},
    ]
    await peer.send("setParameters", parameters=items, id="set")
    found = await peer.text("parameterValues")
    assert found["id"] == "set"
    assert values_in(found)["/robot.speed"] == (3.0, "float64")
    assert node.get_parameter("speed").value == 3.0
    assert node.get_parameter("name").value == "r"
    assert node.get_parameter("ids").value == [1, 2]
    assert node.get_parameter("raw").value == b"\0\x01\x02"
    await peer.until(lambda: len(peer.statuses) >= 3)
    assert {each.split(":")[0] for each in peer.statuses} >= {"'/robot.ids'", "'/robot.name'"}


async def test_nodes_that_do_not_exist_are_not_asked_for_parameters(peer: Peer, meeting: Meeting) -> None:
    """One status is for all of them; those of other nodes are sent, each once."""
    node = await meeting.node("robot", start_parameter_services=True)
    node.declare_parameter("speed", 2.0)
    names = [f"/nobody{number:04}.a" for number in range(9998)]
    expected = {"/robot.speed": (2.0, "float64")}
    assert await peer.parameters("/robot.speed", "/robot.speed", *names) == expected
    await peer.until(lambda: peer.statuses)
    missing = "'/nobody0000', '/nobody0001', '/nobody0002' and 9995 more"
    assert peer.statuses == [f"These nodes do not serve parameters now: {missing}"]


async def test_changes_of_parameters_are_sent(peer: Peer, meeting: Meeting) -> None:
    """Of the names that the client watches, without an id."""
    node = await meeting.node("robot", start_parameter_services=True)
    node.declare_parameter("speed", 2.0)
    node.declare_parameter("name", "r")
    await peer.send("subscribeParameterUpdates", parameterNames=["/robot.speed"])
    while not await node.count_subscribers("/parameter_events"):
        pass
    node.set_parameters([node.get_parameter("name"), *_parameters(speed=5.0)])
    found = await peer.text("parameterValues")
    assert "id" not in found
    assert values_in(found) == {"/robot.speed": (5.0, "float64")}


def _parameters(**values: Any) -> list[Any]:
    from actors import Parameter  # noqa: PLC0415

    return [Parameter(name, value=value) for name, value in values.items()]


async def test_the_connection_graph(peer: Peer, meeting: Meeting) -> None:
    """Who publishes, subscribes and serves; then what has changed."""
    talker = await meeting.node("talker")
    talker.create_publisher(String, "chatter", 1)
    await peer.send("subscribeConnectionGraph")
    published = dict[str, list[str]]()
    while published.get("/chatter") != ["/talker"]:
        for each in (await peer.text("connectionGraphUpdate"))["publishedTopics"]:
            published[each["name"]] = each["publisherIds"]
    await talker.__aexit__(None, None, None)
    removed = list[str]()
    while "/chatter" not in removed:
        removed += (await peer.text("connectionGraphUpdate"))["removedTopics"]


async def test_assets(peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files in the share folder of a package; nothing else."""
    share = tmp_path / "share" / "robot"
    (share / "meshes").mkdir(parents=True)
    (share / "package.xml").write_text("<package/>")
    (share / "meshes" / "a b.stl").write_bytes(b"solid")
    (tmp_path / "share" / "secret").write_text("secret")
    (share / "link").symlink_to(tmp_path / "share" / "secret")
    (share / "circle").symlink_to(share / "circle")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    await peer.send("fetchAsset", uri="package://robot/meshes/a%20b.stl", requestId=1)
    assert await peer.binary(4) == b"\x04\x01" + bytes(8) + b"solid"
    for uri in (
        "package://robot/../secret",
        "package://robot/meshes/%2e%2e/%2e%2e/secret",
        "package://robot/link",
        "package://robot/circle",
        "package://robot/meshes",
        "package://robot//etc/passwd",
        "package://robot/a%00b",
        "package://nowhere/a",
        "package://../a",
        "package:///etc/passwd",
        "file:///etc/passwd",
        "http://[",
        "",
    ):
        await peer.send("fetchAsset", uri=uri, requestId=2)
        found = await peer.binary(4)
        assert found[:6] == b"\x04\x02\0\0\0\x01", uri
        assert b"secret\n" not in found


async def test_who_may_read_only(reader: Peer, meeting: Meeting) -> None:
    """Without the token topics are read, and nothing is controlled."""
    info = await reader.text("serverInfo")
    assert {"clientPublish", "services"}.isdisjoint(info["capabilities"])
    node = await meeting.node("server")
    node.create_publisher(String, "chatter", latched(1)).publish(String(data="read"))
    node.create_service(Trigger, "trigger", lambda request: Trigger.Response())
    await reader.subscribe("/chatter")
    assert (await reader.message(String)).data == "read"
    channel = {"id": 1, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/String"}
    await reader.send("advertise", channels=[channel])
    await reader.until(lambda: any("token" in each for each in reader.statuses))
    assert reader.services == {}


async def connect(site: Site, path: str, status: int, **headers: str) -> None:
    """Try to connect; the answer has this status."""
    try:
        async with site.client.ws_connect(path, protocols=[SDK], headers=headers):
            found = 101
    except aiohttp.WSServerHandshakeError as error:
        found = error.status
    assert found == status, (path, headers)


async def test_who_may_connect(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the page, with a token in the header or the address; pages of Foxglove and named sites only."""
    options = WebOptions(
        port=0, tools=("foxglove",), host="127.0.0.1", token=TOKEN, allowed_origins=("https://tools.example",)
    )
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, options).open()
        for origin in ("https://app.foxglove.dev", "https://tools.example", "file://"):
            await connect(site, "/foxglove", 101, Origin=origin)
        for origin in ("https://evil.example", "null", "http://app.foxglove.dev"):
            await connect(site, "/foxglove", 403, Origin=origin)
        await connect(site, "/api/live", 403, Origin="https://app.foxglove.dev")
        await connect(site, "/foxglove", 421, Host="evil.example")
        await connect(site, f"/foxglove?token={TOKEN}", 101, Host="robot.example")
        assert (await site.client.get("/")).status == 200
        monkeypatch.setattr(type(site.observer), "guarded", property(lambda _: True))
        await connect(site, "/foxglove", 401)
        await connect(site, "/foxglove?token=wrong", 401)
        await connect(site, "/foxglove", 401, Cookie=f"callboard-{site.server.port}={TOKEN}")
        await connect(site, f"/foxglove?token={TOKEN}", 101)
        await connect(site, "/foxglove", 101, Authorization=f"Bearer {TOKEN}")


async def test_without_a_page_there_is_nothing_else(site: Site) -> None:
    """Neither the page nor its API; probes and metrics are there."""
    for path in ("/index.html", "/api/topics"):
        assert (await site.client.get(path)).status == 404
    assert (await site.json("/healthz"))["status"] == "ok"
    assert "callboard_web_dropped_messages_total 0.0" in await (await site.client.get("/metrics")).text()


async def test_malformed_messages_leave_a_client_connected(peer: Peer) -> None:
    """Each has a status; the next request is answered."""
    await peer.send("subscribe", subscriptions=[{"id": n, "channelId": n} for n in range(9999)])
    for text in ("", "{", "[]", '{"op":"x"}', "[" * 10_000):
        await peer.socket.send_str(text)
    for data in (b"", b"\x00", b"\x01", b"\x02" + b"\xff" * 40):
        await peer.socket.send_bytes(data)
    await peer.until(lambda: len(peer.statuses) >= 8)
    await peer.parameters()


async def test_what_is_too_large_ends_the_connection(site: Site, meeting: Meeting) -> None:
    """A client that may only read may send less; others go on."""
    async with (
        site.client.ws_connect("/", protocols=[SDK]) as guilty,
        site.client.ws_connect("/", protocols=[SDK]) as innocent,
    ):
        await guilty.send_str(json.dumps({"op": "x" * 300_000}))
        async with asyncio.timeout(DEADLINE_SEC):
            async for _ in guilty:
                pass
        assert guilty.close_code == 1009
        await Peer(innocent).parameters()


async def test_a_client_that_only_asks_is_not_read(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It fills the kernel's buffers, not the server's memory; another client is served."""
    share = tmp_path / "share" / "robot"
    share.mkdir(parents=True)
    (share / "package.xml").write_text("<package/>")
    (share / "mesh").write_bytes(bytes(64 * 1024))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    sent = 0
    async with site.client.ws_connect("/", protocols=[SDK]) as guilty:
        uri = f"package://robot/{'./' * 1900}mesh"

        async def ask() -> None:
            nonlocal sent
            for number in range(20_000):
                await guilty.send_str(json.dumps({"op": "fetchAsset", "uri": uri, "requestId": number}))
                sent += 1

        task = asyncio.get_running_loop().create_task(ask())
        async with site.client.ws_connect("/", protocols=[SDK]) as socket:
            before = -1
            while before < sent:  # until nothing is read of it while the other one gets 20 answers
                before = sent
                for _ in range(20):
                    await Peer(socket).parameters()
        assert not task.done()
        task.cancel()
        await asyncio.wait([task])


async def test_a_message_is_left_out_if_the_thread_has_no_room(
    peer: Peer, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client hears of it, and gets the next one."""
    publisher = (await meeting.node("talker")).create_publisher(String, "/chatter", 10)
    await peer.subscribe("/chatter")
    await until(publisher.get_subscription_count)
    monkeypatch.setattr(client_module, "LOOP_BYTES", 0)
    with monkeypatch.context() as full:
        full.setattr(worker, "MAX_WAITING", 0)
        publisher.publish(String(data="first"))
        await peer.until(lambda: peer.statuses)
    assert peer.statuses[0].startswith("A message of '/chatter' is left out: ")
    publisher.publish(String(data="second"))
    assert (await peer.message(String)).data == "second"


async def test_the_graph_is_looked_at_again_if_the_thread_had_no_room(
    peer: Peer, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its next change may be far."""
    await peer.text("serverInfo")
    update, refused = Catalogue.update, 0

    async def busy_once(*args: Any) -> bool:
        nonlocal refused
        if not refused:
            refused += 1
            raise TooMuchWorkError("busy")
        return await update(*args)

    monkeypatch.setattr(Catalogue, "update", busy_once)
    (await meeting.node("talker")).create_publisher(String, "/chatter")
    await peer.until(lambda: "/chatter" in peer.channels)
    assert refused
