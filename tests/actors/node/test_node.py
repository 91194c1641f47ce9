"""Nodes: their names, their life, and what is left of them."""

from __future__ import annotations

import asyncio
import gc
import math
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.naming import MessageType
from actors.interfaces.std_msgs.msg import Int64, String
from proto.errors import InvalidNamespaceError, InvalidNodeNameError, InvalidUrlError
from tests.actors.meeting import KEEP_ALL, latched, matched, turns, until
from tests.seams.nodes import link_of

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting


@pytest.mark.parametrize(
    ("namespace", "full"), [(None, "/n"), ("", "/n"), ("/", "/n"), ("ns", "/ns/n"), ("/a/b", "/a/b/n")]
)
def test_a_namespace_becomes_absolute(namespace: str | None, full: str) -> None:
    """'' is '/', 'ns' is '/ns'."""
    node = actors.Node("n", namespace=namespace)
    assert node.get_fully_qualified_name() == full
    assert node.get_name() == "n"
    assert node.get_namespace() == (full.removesuffix("/n") or "/")


def test_bad_names_are_refused() -> None:
    """A bad name, namespace or URL has an error of its own."""
    with pytest.raises(InvalidNodeNameError):
        actors.Node("no?")
    with pytest.raises(InvalidNamespaceError):
        actors.Node("n", namespace="/1a")
    with pytest.raises(InvalidUrlError):
        actors.Node("n", url="http://localhost")


def test_a_logger_is_named_after_its_node() -> None:
    """'my_ns.my_node'; in the root namespace just the node's name."""
    assert actors.Node("my_node", namespace="/my_ns").get_logger().name == "my_ns.my_node"
    assert actors.Node("my_node").get_logger().name == "my_node"


def test_a_node_needs_no_loop_to_be_made() -> None:
    """A node and everything it has can be made, and destroyed, without a running loop."""
    node = actors.Node("early")
    publisher = node.create_publisher(String, "chatter")
    publisher.publish(String(data="x"))
    node.create_subscription(String, "chatter", lambda msg: None)
    node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
    node.create_client(AddTwoInts, "add")
    node.create_timer(1, lambda: None)
    node.destroy_node()
    node.destroy_node()


async def test_what_is_made_before_entering_becomes_live(meeting: Meeting) -> None:
    """Entities made before `async with` work in it, and are gone after it."""
    node = meeting.absent("both")
    received: list[str] = []
    node.create_subscription(String, "chatter", lambda msg: received.append(msg.data))
    publisher = node.create_publisher(String, "chatter")
    assert not node.connected
    async with node as entered:
        assert entered is node
        await matched(publisher)
        publisher.publish(String(data="hello"))
        await until(lambda: received)
    assert not node.connected
    await until(lambda: meeting.broker.stats().endpoints == 0)


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_run_returns_when_the_node_is_destroyed(meeting: Meeting, kind: str) -> None:
    """`run` ends with destroy_node, called from a callback of either kind; running twice is refused."""
    node = meeting.absent("both")

    async def slow(msg: String) -> None:
        node.destroy_node()

    node.create_subscription(
        String, "chatter", slow if kind == "async def" else lambda msg: node.destroy_node()
    )
    publisher = node.create_publisher(String, "chatter")
    running = asyncio.create_task(node.run())
    await matched(publisher)
    with pytest.raises(actors.NodeAlreadyRunningError):
        await node.run()
    with pytest.raises(RuntimeError, match="running already"):
        await node.__aenter__()
    publisher.publish(String())
    async with asyncio.timeout(20):
        await running
    with pytest.raises(actors.NodeDestroyed):
        await node.run()
    assert node.callback_errors == 0


async def test_a_destroyed_node_makes_nothing(meeting: Meeting) -> None:
    """Every entity is a RuntimeError on a destroyed node; destroying twice is no error."""
    async with meeting.absent("gone") as node:
        pass
    node.destroy_node()
    makers: list[Any] = [
        lambda: node.create_publisher(String, "chatter"),
        lambda: node.create_subscription(String, "chatter", lambda msg: None),
        lambda: node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response()),
        lambda: node.create_client(AddTwoInts, "add"),
        lambda: node.create_timer(1, lambda: None),
    ]
    for make in makers:
        with pytest.raises(RuntimeError, match="destroyed"):
            make()
    with pytest.raises(actors.NodeDestroyed):
        async with node:
            pass


async def test_nothing_is_left_of_a_node(meeting: Meeting) -> None:
    """After `async with` no task is left, whatever was going on, and no socket."""
    before = asyncio.all_tasks()
    cancelled: list[str] = []

    async def endless(*_: Any) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            cancelled.append("yes")
            raise

    async with meeting.absent("busy", stop_timeout_sec=0.05) as node:
        for concurrent in (False, True):
            node.create_subscription(String, "chatter", endless, concurrent=concurrent)
        node.create_service(AddTwoInts, "add", endless, concurrent=True)  # type: ignore[arg-type]
        timer = node.create_timer(0, endless)
        client = node.create_client(AddTwoInts, "add")
        publisher = node.create_publisher(String, "chatter")
        await matched(publisher, 2)
        await client.wait_for_service()
        publisher.publish(String())
        call = client.call_async(AddTwoInts.Request())
        await until(lambda: timer.ticks)
        await meeting.settled(node)
    with pytest.raises((actors.ServiceUnavailable, actors.NodeDestroyed)):
        call.result()  # its handler was cancelled, or its client destroyed
    assert cancelled
    await until(lambda: meeting.broker.stats().connections == 0)
    assert asyncio.all_tasks() - before == set()
    gc.collect()


async def test_an_error_in_the_body_comes_through(meeting: Meeting) -> None:
    """What the body of `async with node` raises is raised, as it is."""
    with pytest.raises(ZeroDivisionError):
        async with meeting.absent("short"):
            raise ZeroDivisionError


async def test_a_cancelled_body_stops_the_node(meeting: Meeting) -> None:
    """Cancelling the task that runs a node stops it cleanly."""
    node = meeting.absent("short")
    running = asyncio.create_task(node.run())
    await until(lambda: node.connected)
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    await until(lambda: meeting.broker.stats().connections == 0)


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_on_error_stop_ends_the_node_with_the_error(meeting: Meeting, kind: str) -> None:
    """on_error='stop': the error of a callback comes out of `run` and of `async with`."""

    def plain() -> None:
        raise ZeroDivisionError("stop me")

    async def slow() -> None:
        plain()

    callback = plain if kind == "def" else slow
    runner = meeting.absent("runner", on_error="stop")
    runner.create_timer(0, callback)
    with pytest.raises(ZeroDivisionError, match="stop me"):
        await runner.run()
    entered = meeting.absent("entered", on_error="stop")
    entered.create_timer(0, callback)
    with pytest.raises(ZeroDivisionError):
        async with entered:
            await asyncio.Event().wait()
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0


async def test_a_body_that_fails_while_its_node_does_is_not_left_cancelled(meeting: Meeting) -> None:
    """When body and node fail together the body's error is raised, and no cancellation is left over."""
    node = meeting.absent("both", on_error="stop")

    async def body() -> None:
        node.create_timer(0, lambda: 1 // 0)
        try:
            await asyncio.Event().wait()
        finally:
            raise KeyError("the body's own")

    with pytest.raises(KeyError):
        async with node:
            await body()
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0


async def test_a_taken_name_is_refused(meeting: Meeting) -> None:
    """A second node of the same full name gets NodeNameTaken from `run` and `async with`; the first lives."""
    first = await meeting.node("same")
    await meeting.node("same", namespace="/other")
    with pytest.raises(actors.NodeNameTaken, match="/same"):
        await meeting.absent("same").run()
    with pytest.raises(actors.NodeNameTaken):
        async with meeting.absent("same"):
            await asyncio.Event().wait()
    with pytest.raises(actors.NodeNameTaken):
        async with meeting.absent("same") as node:
            await node.wait_for_node("/never")
    assert first.connected
    assert link_of(first).connections == 1


async def test_without_a_broker_a_connect_timeout_holds(tmp_path: Path) -> None:
    """connect_timeout_sec: BrokerUnreachable, a ConnectionError, from `async with` and `run`."""
    for timeout in (0, 0.05):
        url = f"callboard+unix://{tmp_path}/none"
        with pytest.raises(actors.BrokerUnreachable, match="callboard broker"):
            async with actors.Node("n", url=url, connect_timeout_sec=timeout):
                pytest.fail("it must not enter")
        with pytest.raises(ConnectionError):
            await actors.Node("n", url=url, connect_timeout_sec=timeout).run()
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_the_mailbox_is_the_nodes(meeting: Meeting) -> None:
    """Issue: callbacks of one node run one at a time, whatever they belong to."""
    node = await meeting.node("both")
    inside = 0
    seen: list[str] = []

    async def enter(name: str) -> None:
        nonlocal inside
        inside += 1
        assert inside == 1
        await turns()
        inside -= 1
        seen.append(name)

    async def on_message(msg: Int64) -> None:
        await enter("message")

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await enter("request")
        return AddTwoInts.Response()

    async def tick() -> None:
        timer.cancel()
        await enter("tick")

    node.create_subscription(Int64, "a", on_message)
    node.create_subscription(Int64, "b", on_message)
    node.create_service(AddTwoInts, "add", handle)
    publishers = [node.create_publisher(Int64, name) for name in ("a", "b")]
    client = node.create_client(AddTwoInts, "add")
    for entity in (*publishers, client):
        await matched(entity)
    timer = node.create_timer(0, tick)
    for publisher in publishers:
        publisher.publish(Int64())
    await client.call(AddTwoInts.Request())
    await until(lambda: len(seen) == 4)
    assert sorted(seen) == ["message", "message", "request", "tick"]
    assert node.callback_errors == 0


async def test_qos_mismatch_warns_both_and_delivers(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """Both sides log the policy's name, and the message arrives all the same."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[int] = []
    publisher = talker.create_publisher(Int64, "numbers")
    listener.create_subscription(Int64, "numbers", lambda msg: received.append(msg.data), latched(5))
    await matched(publisher)
    await meeting.settled(talker, listener)
    texts = {record.name: record.getMessage() for record in caplog.records if "QoS" in record.getMessage()}
    assert texts["callboard.talker"].startswith(
        "New subscription discovered on topic '/numbers', requesting incompatible QoS"
    )
    assert texts["callboard.listener"].startswith(
        "New publisher discovered on topic '/numbers', offering incompatible QoS"
    )
    assert all("DURABILITY" in text for text in texts.values())
    publisher.publish(Int64(data=1))
    await until(lambda: received)


async def test_type_mismatch_warns_both_and_does_not_connect(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """Another type on the same topic: no match, no message, a warning on both sides."""
    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    received: list[Any] = []
    publisher = talker.create_publisher(Int64, "things")
    listener.create_subscription(String, "things", received.append)
    await meeting.settled(talker, listener)
    publisher.publish(Int64())
    await meeting.settled(talker, listener)
    assert publisher.get_subscription_count() == 0
    assert received == []
    warned = {record.name for record in caplog.records if "/things" in record.getMessage()}
    assert {"callboard.talker", "callboard.listener"} <= warned


async def test_one_class_in_two_scripts_is_warned_of_with_a_remedy(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """Both sides of topics and services hear how to mend it; with one `type_name` the classes match."""

    def classes(script: str, **names: str) -> tuple[Any, Any]:
        reading = MessageType("Reading", (actors.Message,), {"__module__": script}, **names)
        parts = {"__module__": script, "Request": reading, "Response": reading}
        return reading, type("Calibrate", (actors.Service,), parts)

    talker, listener = await meeting.node("talker"), await meeting.node("listener")
    (sent, asked), (received, served) = classes("pub"), classes("sub")
    talker.create_publisher(sent, "readings")
    talker.create_client(asked, "calibrate")
    listener.create_subscription(received, "readings", print)
    listener.create_service(served, "calibrate", print)
    await meeting.settled(talker, listener)
    remedy = "put it in a module that both import, or give both classes the same type_name="
    warned = [record for record in caplog.records if remedy in record.getMessage()]
    assert sorted(record.name for record in warned) == 2 * ["callboard.listener"] + 2 * ["callboard.talker"]
    (sent, _), (received, _) = (
        classes("pub", type_name="lab/msg/Reading"),
        classes("sub", type_name="lab/msg/Reading"),
    )
    publisher = talker.create_publisher(sent, "same")
    listener.create_subscription(received, "same", print)
    await until(lambda: publisher.get_subscription_count() == 1)


async def test_destroy_methods_know_their_own(meeting: Meeting) -> None:
    """`destroy_*` is True once, False for strangers."""
    node, other = await meeting.node("one"), await meeting.node("other")
    service = node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
    client = node.create_client(AddTwoInts, "add")
    assert not other.destroy_service(service)
    assert not other.destroy_client(client)
    assert node.destroy_service(service)
    assert node.destroy_client(client)
    assert not node.destroy_client(client)


async def test_two_domains_do_not_meet(meeting: Meeting) -> None:
    """Graphs of different domains are disjoint: names may repeat, messages do not cross."""
    zero, one = await meeting.node("same"), await meeting.node("same", domain=1)
    publisher = zero.create_publisher(Int64, "numbers", KEEP_ALL)
    one.create_subscription(Int64, "numbers", lambda msg: None)
    await meeting.settled(zero, one)
    assert publisher.get_subscription_count() == 0
    assert await one.get_fully_qualified_node_names() == ["/same"]


def test_remaps_apply_to_what_a_node_has() -> None:
    """A node's own arguments rename it and its topics."""
    node = actors.Node("n", cli_args=["--ros-args", "-r", "__node:=m", "-r", "chatter:=/loud"])
    assert node.get_name() == "m"
    assert node.create_publisher(String, "chatter").topic_name == "/loud"
    assert node.resolve_topic_name("chatter") == "/loud"
    assert node.resolve_topic_name("chatter", only_expand=True) == "/chatter"
    assert node.resolve_service_name("~/ask") == "/m/ask"


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"domain": 999}, ValueError),
        ({"domain": -1}, ValueError),
        ({"domain": "x"}, TypeError),
        ({"domain": True}, TypeError),
        *(
            ({name: value}, error)
            for name in ("connect_timeout_sec", "default_call_timeout_sec", "stop_timeout_sec")
            for error, values in ((ValueError, (-1.0, math.nan)), (TypeError, ("1", True)))
            for value in values
        ),
        ({"default_call_timeout_sec": None}, TypeError),
    ],
)
def test_wrong_numbers_are_refused_at_once(options: dict[str, Any], error: type[Exception]) -> None:
    """The text names the argument; infinite times are allowed."""
    with pytest.raises(error, match=next(iter(options))):
        actors.Node("n", **options)
    actors.Node("n", domain=0, connect_timeout_sec=0, default_call_timeout_sec=math.inf, stop_timeout_sec=0)


def test_process_arguments_may_be_given() -> None:
    """They replace those of `actors.run`, and count only with `use_global_arguments`; the node's own win."""
    given = actors.parse_ros_arguments(["--ros-args", "-r", "t:=u", "-p", "a:=1", "-p", "b:=1"])
    node = actors.Node("n", process_arguments=given, cli_args=["--ros-args", "-p", "b:=2"])
    assert node.resolve_topic_name("t") == "/u"
    assert node.argument_overrides == {"a": 1, "b": 2}
    without = actors.Node("n", process_arguments=given, use_global_arguments=False)
    assert without.resolve_topic_name("t") == "/t"
    assert without.argument_overrides == {}
