"""What a node can ask about the graph; the answers are the broker's."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.graph.view import LAST_QUERY_TIMEOUT_SEC
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import definition, type_hash
from actors.interfaces.std_msgs.msg import Int64, String
from proto.errors import InvalidNameError
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, turns, until
from tests.seams.nodes import link_of, queries_of
from tests.simulation.network import BROKER
from tests.simulation.stage import play

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting
    from tests.simulation.stage import Stage


async def test_counts_follow_what_is_created(meeting: Meeting) -> None:
    """0, 1, 2 as entities are created, at once, by relative and by full name."""
    node, other = await meeting.node("one"), await meeting.node("other")
    for count in range(3):
        for name in ("chatter", "/chatter"):
            assert await node.count_publishers(name) == count
            assert await node.count_subscribers(name) == count
            assert await node.count_services(name) == count
            assert await node.count_clients(name) == count
        maker = (node, other, node)[count]
        maker.create_publisher(String, "chatter")
        maker.create_subscription(String, "chatter", lambda msg: None)
        maker.create_service(AddTwoInts, "chatter", lambda request: AddTwoInts.Response())
        maker.create_client(AddTwoInts, "chatter")
        await meeting.settled(other)


async def test_bad_names_are_refused(meeting: Meeting) -> None:
    """'42' is a ValueError that says so, a number a TypeError."""
    node = await meeting.node("one")
    with pytest.raises(ValueError, match="nvalid"):
        await node.count_publishers("42")
    with pytest.raises(InvalidNameError):
        await node.count_services("42")
    with pytest.raises(TypeError):
        await node.count_publishers(42)  # type: ignore[arg-type]


async def test_endpoint_infos_tell_everything(meeting: Meeting) -> None:
    """Node name, namespace, type, hash and QoS of each endpoint of a topic."""
    node = await meeting.node("one", namespace="/ns")
    node.create_publisher(String, "chatter", KEEP_ALL)
    node.create_subscription(String, "chatter", lambda msg: None, 3)
    (publisher,) = await node.get_publishers_info_by_topic("chatter")
    (subscription,) = await node.get_subscriptions_info_by_topic("/ns/chatter")
    for info in (publisher, subscription):
        assert (info.node_name, info.node_namespace) == ("one", "/ns")
        assert (info.topic_type, info.topic_type_hash) == ("std_msgs/msg/String", type_hash(String))
    assert publisher.qos_profile.history == actors.HistoryPolicy.KEEP_ALL
    assert subscription.qos_profile.depth == 3


async def test_names_and_types(meeting: Meeting) -> None:
    """Queries by node and for the whole graph agree with what there is, hidden nothing, sorted."""
    node, other = await meeting.node("b"), await meeting.node("a", namespace="/ns")
    node.create_publisher(String, "chatter")
    node.create_subscription(Int64, "chatter", lambda msg: None)
    other.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
    node.create_client(AddTwoInts, "/ns/add")
    await meeting.settled(other)
    assert await node.get_node_names_and_namespaces() == [("b", "/"), ("a", "/ns")]
    assert await node.get_node_names() == ["b", "a"]
    assert await node.get_topic_names_and_types() == [
        ("/chatter", ["std_msgs/msg/Int64", "std_msgs/msg/String"])
    ]
    services = [("/ns/add", ["example_interfaces/srv/AddTwoInts"])]
    assert await node.get_service_names_and_types() == services
    assert await node.get_service_names_and_types_by_node("a", "/ns") == services
    assert await node.get_client_names_and_types_by_node("b", "/") == services
    assert await node.get_publisher_names_and_types_by_node("b", "/") == [
        ("/chatter", ["std_msgs/msg/String"])
    ]
    assert await node.get_subscriber_names_and_types_by_node("b", "/") == [
        ("/chatter", ["std_msgs/msg/Int64"])
    ]


async def test_waiting_for_a_node(meeting: Meeting) -> None:
    """True for one that is there, also with 0; False for one that never comes; pushed when one comes."""
    node = await meeting.node("one")
    assert await node.wait_for_node("/one", 20)
    assert await node.wait_for_node("/one", 0)
    assert not await node.wait_for_node("/never", 0.02)
    assert not await node.wait_for_node("/never", 0)
    waiting = asyncio.create_task(node.wait_for_node("/late"))
    await meeting.settled(node)
    assert not waiting.done()
    await meeting.node("late")
    async with asyncio.timeout(20):
        assert await waiting


def test_a_wait_for_a_broker_that_says_nothing_ends() -> None:
    """Somebody who waits for 0.1 s hears soon after that nobody came, and not of the broker's troubles."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("one")
        stage.network.block("one", BROKER)
        began = stage.loop.time()
        assert not await node.wait_for_node("/never", 0.1)
        assert stage.loop.time() - began < 0.1 + LAST_QUERY_TIMEOUT_SEC + 0.1

    play(scene)


def test_a_query_after_a_lost_session_fails_at_once() -> None:
    """It does not wait for the next session, for which nobody knows how long."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("one")
        await stage.stop_broker()
        await stage.until(lambda: not node.connected)
        began = stage.loop.time()
        for query in (node.get_graph, node.get_broker_stats, lambda: node.get_type_definition("none")):
            with pytest.raises(actors.BrokerUnreachable):
                await query()
        assert stage.loop.time() == began

    play(scene)


async def test_a_wait_survives_a_broker(meeting: Meeting) -> None:
    """A wait that began before a broker's restart is answered by the new one."""
    node = await meeting.node("one")
    waiting = asyncio.create_task(node.wait_for_node("/late"))
    await meeting.settled(node)
    await meeting.restart_broker()
    await meeting.node("late")
    async with asyncio.timeout(20):
        assert await waiting


async def test_another_session_with_the_same_graph_is_a_step_of_a_watch(meeting: Meeting) -> None:
    """Without a change: what depends on the broker, such as its rules, may be another now."""
    node = await meeting.node("one")
    batches = node.watch_graph().batches()
    async with asyncio.timeout(DEADLINE_SEC):
        assert [change.node for change in await anext(batches)] == ["/one"]
        await meeting.restart_broker()
        assert await anext(batches) == []


async def test_a_graph_in_which_nothing_may_be_seen_is_a_step_of_a_watch(
    meeting: Meeting, tmp_path: Path
) -> None:
    """A user without the right to see gets an empty graph, and does not wait for it forever."""
    rules = tmp_path / "rules.toml"
    rules.write_text('[local]\nuser="a"\n[users.a]\nroles=["a"]\n[roles.a]\nallow.node=["/**"]\n')
    rules.chmod(0o600)
    await meeting.restart_broker(auth=rules)
    node = await meeting.node("one")
    async with asyncio.timeout(DEADLINE_SEC):
        assert await anext(node.watch_graph().batches()) == []


async def test_a_wait_can_be_cancelled_from_outside(meeting: Meeting) -> None:
    """`asyncio.timeout` around wait_for_node works; nothing is left at the broker."""
    node = await meeting.node("one")
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.02):
            await node.wait_for_node("/never")
    assert link_of(node).answers == {}


async def test_a_wait_ends_with_its_node(meeting: Meeting) -> None:
    """A wait on a node that is destroyed meanwhile raises instead of hanging."""
    node = await meeting.node("one")
    waiting = asyncio.create_task(node.wait_for_node("/never"))
    await turns()
    node.destroy_node()
    async with asyncio.timeout(20):
        with pytest.raises(actors.NodeDestroyed):
            await waiting


def nothing_asked(node: actors.Node) -> bool:
    """Tell whether no question to the broker is remembered."""
    return not link_of(node).answers


async def test_queries_without_a_broker_give_up(tmp_path: Path) -> None:
    """A query raises BrokerUnreachable when no broker answers in time."""
    async with actors.Node("one", url=f"callboard+unix://{tmp_path}/none") as node:
        with pytest.raises(actors.BrokerUnreachable, match="none"):
            await queries_of(node).snapshot(0.01)
        with pytest.raises(actors.BrokerUnreachable):
            await queries_of(node).describe("RIHS01_0", 0.01)
        assert not await node.wait_for_node("/one", 0.01)
        assert nothing_asked(node)


async def test_a_query_whose_link_breaks_ends(meeting: Meeting) -> None:
    """The broker dies between question and answer: BrokerUnreachable, soon."""
    node = await meeting.node("one")
    asking = [
        asyncio.create_task(node.get_graph()),
        asyncio.create_task(queries_of(node).describe("RIHS01_0")),
    ]
    await asyncio.sleep(0)
    channel = link_of(node).channel
    assert channel is not None
    channel.abort()
    async with asyncio.timeout(DEADLINE_SEC):
        for task in asking:
            with pytest.raises(actors.BrokerUnreachable):
                await task
    assert nothing_asked(node)


async def test_a_question_that_is_given_up_is_forgotten(meeting: Meeting) -> None:
    """Whoever is cancelled while the broker's answer is on its way leaves nothing behind."""
    node = await meeting.node("one")
    asking = [asyncio.create_task(queries_of(node).describe("RIHS01_0")) for _ in range(2)]
    await asyncio.sleep(0)
    assert not nothing_asked(node)
    for task in asking:
        task.cancel()
    await asyncio.wait(asking)
    assert nothing_asked(node)


async def test_definitions_are_known_by_hash(meeting: Meeting) -> None:
    """The broker gives the definition of every type that was declared; None for others."""
    node = await meeting.node("one")
    node.create_publisher(String, "chatter")
    assert await queries_of(node).describe(type_hash(String)) == definition(String)
    assert await queries_of(node).describe("RIHS01_" + "0" * 64) is None


async def test_nodes_leave_the_graph(meeting: Meeting) -> None:
    """A node that has ended is not in the graph any more."""
    node = await meeting.node("one")
    async with meeting.absent("two"):
        assert await node.wait_for_node("/two", 20)
    await until(lambda: meeting.broker.stats().connections == 1)
    assert await node.get_fully_qualified_node_names() == ["/one"]


async def test_waiting_for_what_is_no_name_is_a_type_error(meeting: Meeting) -> None:
    """As in the other queries."""
    node = await meeting.node("one")
    with pytest.raises(TypeError, match="node name must be a str, not int"):
        await node.wait_for_node(3)  # type: ignore[arg-type]
