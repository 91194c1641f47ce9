"""`callboard node`: list, info, diagnostics."""

from __future__ import annotations

import asyncio
import os
import socket
from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.main import main
from actors.graph.inspector import Inspector
from actors.interfaces.action import action_types
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from broker import Broker, BrokerOptions
from proto import limits
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.url import parse_urls

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk


@pytest.mark.parametrize(
    ("options", "out"),
    [
        ([], "/ns/zoe\n"),
        (["-a"], "/_hidden\n/ns/zoe\n"),
        (["-c"], "1\n"),
        (["-a", "-c"], "2\n"),
        (["--json"], '[{"name": "/ns/zoe"}]\n'),
    ],
)
async def test_list(desk: Desk, options: list[str], out: str) -> None:
    """Full names, sorted, without hidden ones and without the command's own node."""
    async with desk.node("zoe", namespace="ns") as node, desk.node("_hidden") as other:
        await node.get_graph()
        await other.get_graph()
        assert await desk.callboard("node", "list", *options) == (0, out, "")


async def test_nodes_that_share_a_name_are_marked(desk: Desk) -> None:
    """`list` prints the name for each node and warns, `info` shows the endpoints of all and says so."""
    async with desk.node("zoe", shared_name=True) as one, desk.node("zoe", shared_name=True) as other:
        one.create_publisher(String, "chatter")
        other.create_publisher(String, "news")
        await one.get_graph()
        await other.get_graph()
        listed = await desk.callboard("node", "list")
        shown = await desk.callboard("node", "info", "/zoe")
    assert (listed.code, listed.out) == (0, "/zoe\n/zoe\n")
    assert listed.err == (
        "WARNING: Be aware that there are nodes in the graph that share an exact name, which can have"
        " unintended side effects: /zoe (2)\n"
    )
    assert shown.err == (
        'There are 2 nodes in the graph with the exact name "/zoe".'
        " You are seeing information about all of them.\n"
    )
    assert "    /chatter: std_msgs/msg/String\n    /news: std_msgs/msg/String\n" in shown.out


async def test_labels_are_shown_where_nodes_have_some(desk: Desk) -> None:
    """Beside the name, a line each in `info`, in `topic info -v` and `graph`; other lines stay the same."""
    async with desk.node("zoe") as node:
        labels = {"origin": "ros2/7", "host": "robot"}
        bare = node.create_bare_node("adam", labels=labels)
        bare.create_publisher(String, "/chatter")
        node.create_subscription(String, "chatter", print)
        await node.get_graph()
        listed = await desk.callboard("node", "list")
        documents = (await desk.callboard("node", "list", "--json")).json
        info = await desk.callboard("node", "info", "/adam")
        document = (await desk.callboard("node", "info", "/adam", "--json")).json
        plain = await desk.callboard("node", "info", "/zoe")
        topic = await desk.callboard("topic", "info", "-v", "/chatter")
        ends = (await desk.callboard("topic", "info", "/chatter", "--json")).json
        drawn = await desk.callboard("graph")
        graph = (await desk.callboard("graph", "--json")).json
    assert listed == (0, "/adam  origin=ros2/7, host=robot\n/zoe\n", "")
    assert documents == [{"name": "/adam", "labels": labels}, {"name": "/zoe"}]
    lines = "/adam\n  Label host: robot\n  Label origin: ros2/7\n  Subscribers:\n\n"
    assert info.out.startswith(lines)
    assert document["labels"] == labels
    assert plain.out.startswith("/zoe\n  Subscribers:\n    /chatter: std_msgs/msg/String\n")
    assert topic.out.count("Node namespace: /\nNode labels: origin=ros2/7, host=robot\nTopic type:") == 1
    assert topic.out.count("Node namespace: /\nTopic type:") == 1
    assert [each.get("node_labels") for each in ends["publishers"] + ends["subscriptions"]] == [labels, None]
    assert "/adam (host=robot, origin=ros2/7)" in drawn.out
    assert graph["nodes"] == [{"name": "/adam", "labels": labels}, {"name": "/zoe"}]


async def test_info(desk: Desk) -> None:
    """Six headings, names with types, actions by their services, hidden names left out."""
    types: Any = action_types(Fibonacci)
    async with desk.node("zoe", namespace="ns") as node:
        node.create_publisher(String, "chatter")
        node.create_publisher(String, "_secret")
        node.create_service(Trigger, "~/reset", lambda request, response: response)
        node.create_service(types.send_goal, "fibonacci/_action/send_goal", lambda request: request)
        await node.get_graph()
        ended = await desk.callboard("node", "info", "/ns/zoe")
        hidden = await desk.callboard("node", "info", "/ns/zoe", "--include-hidden")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "/ns/zoe\n"
        "  Subscribers:\n\n"
        "  Publishers:\n    /ns/chatter: std_msgs/msg/String\n"
        "  Service Servers:\n    /ns/zoe/reset: std_srvs/srv/Trigger\n"
        "  Service Clients:\n\n"
        "  Action Servers:\n    /ns/fibonacci: example_interfaces/action/Fibonacci\n"
        "  Action Clients:\n\n"
    )
    assert "    /ns/_secret: std_msgs/msg/String\n" in hidden.out
    assert "    /ns/fibonacci/_action/send_goal: example_interfaces/action/Fibonacci_SendGoal\n" in hidden.out


async def test_info_as_json(desk: Desk) -> None:
    """One key for each heading."""
    async with desk.node("zoe") as node:
        node.create_subscription(String, "chatter", print)
        await node.get_graph()
        document = (await desk.callboard("node", "info", "zoe", "--json")).json
    assert document == {
        "name": "/zoe",
        "subscribers": [{"name": "/chatter", "types": ["std_msgs/msg/String"]}],
        "publishers": [],
        "service_servers": [],
        "service_clients": [],
        "action_servers": [],
        "action_clients": [],
    }


@pytest.mark.parametrize(
    ("name", "code", "text"),
    [
        ("/zo", 1, "Unable to find node '/zo'; did you mean '/zoe'?\n"),
        ("/qqq", 1, "Unable to find node '/qqq'\n"),
        ("", 2, "Which node? Write its full name, such as /talker\n"),
    ],
)
async def test_info_of_an_unknown_node(desk: Desk, name: str, code: int, text: str) -> None:
    """ROS 2's text, with what may have been meant."""
    async with desk.node("zoe") as node:
        await node.get_graph()
        assert await desk.callboard("node", "info", name) == (code, "", text)


async def test_info_of_a_suspended_node(capsys: pytest.CaptureFixture[str]) -> None:
    """A node whose link has fallen silent is out of the graph; the command knows why."""
    options = BrokerOptions(port=0, keepalive_sec=0.5, idle_keepalive_sec=0.5)
    hello = frames.Hello(
        limits.PROTOCOL_VERSION,
        {"agent": "mute", "domain": 0, "instance": bytes(16), "token": bytes(16)},
    )
    async with Broker(options) as broker:
        (url,) = parse_urls(broker.url)
        _, writer = await asyncio.open_connection(url.host, url.port)
        writer.write(encode(hello) + encode(frames.Node(1, "/zoe")))  # and never another byte
        async with asyncio.timeout(20):
            while not await asyncio.to_thread(_suspended, broker.url):
                pass
        code = await asyncio.to_thread(main, ["node", "info", "/zoe", "--url", broker.url])
        writer.close()
    captured = capsys.readouterr()
    assert (code, captured.out) == (1, ""), captured.err
    assert captured.err.startswith("Node '/zoe' is suspended: nothing has come from it for ")


def _suspended(url: str) -> bool:
    with Inspector(url) as inspector:
        inspector.graph()  # makes the broker ask who is there
        return any(link.suspended for link in inspector.report().links.values())


async def test_diagnostics(desk: Desk) -> None:
    """Where the node runs and what its callbacks take, for people and as JSON."""

    def answer(_: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()

    async with desk.node("zoe", start_diagnostics_service=True) as node, desk.node("asker") as asker:
        node.create_service(Trigger, "go", answer)
        await asker.create_client(Trigger, "/go").call(Trigger.Request())
        code, out, err = await desk.callboard("node", "diagnostics", "/zoe")
        found = (await desk.callboard("node", "diagnostics", "--json", "zoe")).json
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[:3] == ["/zoe", f"  Host: {socket.gethostname()}", f"  Process: {os.getpid()}"]
    assert next(line for line in lines if "service /go" in line).split()[3] == "1"
    assert (found["node"], found["pid"]) == ("/zoe", os.getpid())
    assert found["stamp_ns"] > 0
    (go,) = (each for each in found["callbacks"] if each["source"] == "/go")
    assert (go["kind"], go["calls"], go["slow"]) == ("service", 1, 0)


async def test_diagnostics_of_a_node_that_does_not_tell(desk: Desk) -> None:
    """One line says so."""
    async with desk.node("zoe", start_diagnostics_service=False) as node:
        await node.get_graph()
        code, out, err = await desk.callboard("node", "diagnostics", "/zoe")
    assert (code, out) == (1, "")
    assert err.startswith("Node '/zoe' has no diagnostics: it is no node of callboard's, or was made with ")
