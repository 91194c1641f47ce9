"""One graph over two brokers: what nodes and commands see of nodes that are connected with the other one."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.cli.main import main
from actors.graph.inspector import Inspector
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from proto.wire.codes import EntryKind
from tests.actors.meeting import until
from tests.integration.conftest import DEADLINE_SEC, free_port

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest.fixture
async def brokers() -> AsyncIterator[tuple[Broker, Broker]]:
    """Two brokers that have met, called alpha and beta."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    alpha = Broker(BrokerOptions(port=0, mesh_listen=endpoint, mesh_name="alpha"))
    beta = Broker(BrokerOptions(port=0, mesh=endpoint, mesh_name="beta"))
    async with alpha, beta:
        async with node(alpha, "here") as here, node(beta, "there"):
            assert await here.wait_for_node("/there", timeout_sec=DEADLINE_SEC)
        yield alpha, beta


def node(broker: Broker, name: str, **options: Any) -> actors.Node:
    """Make a node for a broker."""
    return actors.Node(name, url=broker.url, use_global_arguments=False, **options)


async def publishers(node: actors.Node, topic: str, count: int = 1) -> None:
    """Wait until a node's broker knows the publishers of a topic."""
    async with asyncio.timeout(DEADLINE_SEC):
        while (await node.get_graph()).count(EntryKind.PUBLISHER, topic) < count:
            pass


async def callboard(
    broker: Broker, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, Any, str]:
    """Run a command with --json; return the exit code, its document, and what it has printed to stderr."""
    code = await asyncio.to_thread(main, [*arguments, "--json", "--url", broker.url])
    captured = capsys.readouterr()
    return code, json.loads(captured.out), captured.err


async def test_parameters_services_and_actions_of_the_other_broker(brokers: tuple[Broker, Broker]) -> None:
    """Nodes wait for them, use them, and see who serves them, as those of their own broker."""
    alpha, beta = brokers

    async def execute(goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, goal.request.order])

    async with node(alpha, "server") as server, node(beta, "client") as client:
        server.declare_parameter("speed", 1)
        server.create_service(
            AddTwoInts, "add", lambda request: AddTwoInts.Response(sum=request.a + request.b)
        )
        server.create_action_server(Fibonacci, "fibonacci", execute)
        adder = client.create_client(AddTwoInts, "add")
        assert await adder.wait_for_service(DEADLINE_SEC)
        assert (await adder.call(AddTwoInts.Request(a=1, b=2))).sum == 3
        parameters = actors.ParameterClient(client, "server")
        assert await parameters.wait_for_services(DEADLINE_SEC)
        await parameters.set_parameters([actors.Parameter("speed", value=7)])
        assert server.get_parameter("speed").value == 7
        action = client.create_action_client(Fibonacci, "fibonacci")
        assert await action.wait_for_server(DEADLINE_SEC)
        handle = await action.send_goal(Fibonacci.Goal(order=5))
        assert [list(feedback.sequence) async for feedback in handle] == [[0, 1]]
        status, result = await handle.result()
        assert (status.name, list(result.sequence)) == ("SUCCEEDED", [0, 1, 5])
        (endpoint,) = (await client.get_graph()).endpoints(EntryKind.SERVICE, "/add")
        report = await client.get_broker_stats()
        assert report.brokers[endpoint.broker].name == "alpha"
        assert [each.name for each in report.brokers.values()] == ["beta", "alpha"]


async def test_a_name_of_the_other_broker_is_refused(brokers: tuple[Broker, Broker]) -> None:
    """With the text that a name of the same broker gets."""
    alpha, beta = brokers
    async with node(alpha, "same"), node(beta, "watcher") as watcher:
        assert await watcher.wait_for_node("/same", timeout_sec=DEADLINE_SEC)
        with pytest.raises(actors.NodeNameTaken, match=r"A node named '/same' is there already; give this"):
            async with node(beta, "same"):
                pass


async def test_a_type_of_the_other_broker_is_described(brokers: tuple[Broker, Broker]) -> None:
    """So a reader can decode messages of a type that it does not have."""
    alpha, beta = brokers
    async with node(alpha, "talker") as talker, node(beta, "watcher") as watcher:
        talker.create_publisher(String, "chatter")
        await publishers(watcher, "/chatter")

        def describe() -> bytes | None:
            with Inspector(beta.url) as inspector:
                (entry,) = inspector.graph().endpoints(EntryKind.PUBLISHER, "/chatter")
                return inspector.definition(entry.topic_type_hash)

        definition = await asyncio.to_thread(describe)
        assert definition is not None
        assert b"std_msgs/msg/String" in definition


async def test_commands_show_brokers(
    brokers: tuple[Broker, Broker], capsys: pytest.CaptureFixture[str]
) -> None:
    """Names in lists; the mesh with round trips and traffic."""
    alpha, beta = brokers
    async with node(alpha, "here"), node(beta, "there") as there:
        await publishers(there, "/rosout", 2)
        _, nodes, _ = await callboard(beta, capsys, "node", "list")
        assert nodes == [
            {"name": "/here", "broker": "alpha", "duplicate": False},
            {"name": "/there", "broker": "beta", "duplicate": False},
        ]
        _, info, _ = await callboard(beta, capsys, "topic", "info", "/rosout")
        assert {each["node"]: each["broker"] for each in info["publishers"]} == {
            "/here": "alpha",
            "/there": "beta",
        }
        _, (own, other), _ = await callboard(beta, capsys, "mesh", "list")
        assert (own["name"], own["route"], own["nodes"], own["round_trip_sec"]) == ("beta", "here", 1, None)
        assert (other["name"], other["route"], other["nodes"]) == ("alpha", "direct", 1)
        assert 0 < other["round_trip_sec"] < DEADLINE_SEC
        _, info, _ = await callboard(beta, capsys, "mesh", "info", "alpha")
        assert min(info["traffic"].values()) > 0
        _, info, _ = await callboard(beta, capsys, "mesh", "info")
        assert info["neighbours"] == [{"id": other["id"], "name": "alpha"}]
        assert info["problems"]["malformed"] == 0
        assert beta.mesh_stats().brokers == 1


async def test_a_node_moves_to_the_other_broker(brokers: tuple[Broker, Broker]) -> None:
    """With its name, as soon as its broker has stopped; readers go on."""
    alpha, beta = brokers
    heard: list[str] = []
    async with node(beta, "listener") as listener:
        listener.create_subscription(String, "chatter", lambda message: heard.append(message.data))
        async with actors.Node("mover", url=f"{alpha.url},{beta.url}", use_global_arguments=False) as mover:
            publisher = mover.create_publisher(String, "chatter")
            await publisher.wait_for_subscriptions(1, DEADLINE_SEC)
            publisher.publish(String(data="from alpha"))
            await until(lambda: heard == ["from alpha"])
            await alpha.stop()
            assert await listener.wait_for_node("/mover", timeout_sec=DEADLINE_SEC)
            await until(lambda: beta.stats().connections == 2)
            await publisher.wait_for_subscriptions(1, DEADLINE_SEC)
            publisher.publish(String(data="from beta"))
            await until(lambda: heard[1:] == ["from beta"])
            graph = await listener.get_graph()
            assert graph.nodes().count("/mover") == 1
            assert graph.duplicate_nodes() == {}


@pytest.mark.parametrize("verb", ["hz", "bw"])
async def test_topics_of_the_other_broker_are_measured(
    brokers: tuple[Broker, Broker], capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    """By a subscription: the counters of a broker whose nodes do not subscribe stay at zero."""
    alpha, beta = brokers
    async with node(alpha, "talker") as talker, node(beta, "there") as there:
        publisher = talker.create_publisher(String, "chatter")
        talker.create_timer(0.02, lambda: publisher.publish(String(data="hello")))
        await publishers(there, "/chatter")
        limits = ("--once", "--timeout", str(DEADLINE_SEC))
        code, measured, _ = await callboard(beta, capsys, "topic", verb, "/chatter", *limits)
        assert code == 0
        assert measured["topic"] == "/chatter"
        assert {"hz": "min_sec", "bw": "min_bytes"}[verb] in measured


async def test_duplicate_names_are_marked(
    capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Nodes that took one name before their brokers met are warned, and commands say where they are."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    alpha = Broker(BrokerOptions(port=0, mesh=endpoint, mesh_name="alpha"))
    beta = Broker(BrokerOptions(port=0, mesh=endpoint, mesh_name="beta"))
    between = Broker(BrokerOptions(port=0, mesh_listen=endpoint, mesh_name="between"))
    async with alpha, beta, node(alpha, "same"), node(beta, "same"), between:
        await until(lambda: warnings(caplog) == 2)
        _, nodes, err = await callboard(alpha, capsys, "node", "list")
        assert nodes == [
            {"name": "/same", "broker": "alpha", "duplicate": True},
            {"name": "/same", "broker": "beta", "duplicate": True},
        ]
        assert "/same (2 on alpha, beta)" in err
        _, brokers, _ = await callboard(alpha, capsys, "mesh", "list")
        assert [each["route"] for each in brokers if each["name"] == "beta"] == ["indirect"]
        _, checks, _ = await callboard(alpha, capsys, "doctor")
        found = [each["finding"] for each in checks if each["name"] == "mesh"]
        assert found == ["3 brokers: alpha, beta, between", "2 nodes are /same, on alpha, beta"]


def warnings(caplog: pytest.LogCaptureFixture) -> int:
    """Return how many warnings of the duplicate were logged."""
    text = "Another broker of the mesh has a node named '/same', too: rename one of them"
    return sum(record.getMessage() == text for record in caplog.records)
