"""What waits of a node raise when the node, or what they wait for, ends meanwhile."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import pytest

import actors
from actors.interfaces.action_tutorials_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.actors.meeting import BARE, DEADLINE_SEC, KEEP_ALL, turns, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from tests.actors.meeting import Meeting

NO_BROKER: Final = "callboard://127.0.0.1:1"


async def for_ever(_: object) -> Any:
    await asyncio.Event().wait()


def call(node: actors.Node) -> Awaitable[Any]:
    node.create_service(AddTwoInts, "add", for_ever, concurrent=True)
    client = node.create_client(AddTwoInts, "add")

    async def call_when_ready() -> None:
        await client.wait_for_service()
        await client.call(AddTwoInts.Request())

    return call_when_ready()


def full(node: actors.Node) -> actors.Publisher[String]:
    publisher = node.create_publisher(String, "chatter", KEEP_ALL)
    with suppress(actors.PublisherFull):
        while True:
            publisher.publish(String(data="x" * 100_000))
    return publisher


async def result(node: actors.Node) -> Any:
    node.create_action_server(Fibonacci, "fibonacci", for_ever)
    client = node.create_action_client(Fibonacci, "fibonacci")
    await client.wait_for_server()
    return await (await client.send_goal(Fibonacci.Goal())).result()


async def first(items: AsyncIterator[Any]) -> Any:
    """Iterate until the end, as programs do."""
    async for _ in items:
        pass
    return "ended"


WAITS: Final[dict[str, Callable[[actors.Node], Awaitable[Any]]]] = {
    "call": call,
    "wait_for_service": lambda node: node.create_client(AddTwoInts, "absent").wait_for_service(),
    "wait_for_services": lambda node: actors.ParameterClient(node, "absent").wait_for_services(),
    "wait_for_server": lambda node: node.create_action_client(Fibonacci, "absent").wait_for_server(),
    "result": result,
    "wait_for_subscriptions": lambda node: node.create_publisher(String, "quiet").wait_for_subscriptions(),
    "wait_for_message": lambda node: actors.wait_for_message(String, node, "quiet"),
    "wait_for_node": lambda node: node.wait_for_node("/absent"),
    "sleep_for": lambda node: node.get_clock().sleep_for(1000),
    "sleep_until": lambda node: node.get_clock().sleep_until(
        node.get_clock().now() + actors.Duration(seconds=1000)
    ),
    "rate": lambda node: node.create_rate(0.001).sleep(),
}
"""Waits of a connected node that nothing ends but the node."""

UNCONNECTED: Final[dict[str, Callable[[actors.Node], Awaitable[Any]]]] = {
    "early call": lambda node: node.create_client(AddTwoInts, "add").call(AddTwoInts.Request()),
    "ready": lambda node: full(node).ready(),
    "flush": lambda node: node.create_publisher(String, "chatter").flush(),
    "wait_for_node": lambda node: node.wait_for_node("/absent"),
    "get_graph": lambda node: node.get_graph(),
    "get_broker_stats": lambda node: node.get_broker_stats(),
}
"""Waits of a node without a broker."""

ITERATIONS: Final[dict[str, Callable[[actors.Node], AsyncIterator[Any]]]] = {
    "subscription": lambda node: aiter(node.create_subscription(String, "quiet")),
    "graph": lambda node: aiter(node.watch_graph()),
}


async def leave(node: actors.Node) -> None:
    await node.__aexit__(None, None, None)


async def destroy(node: actors.Node) -> None:
    node.destroy_node()


END = pytest.mark.parametrize("end", [leave, destroy])


async def ended_wait(node: actors.Node, wait: Awaitable[Any], end: Callable[..., Any]) -> Any:
    """Let the node end during the wait; return the error that the wait raises."""
    waiting = asyncio.ensure_future(wait)
    if node.connected:
        for _ in range(3):  # until what it has declared is known
            await node.get_graph()
    await turns()
    assert not waiting.done()
    await end(node)
    await asyncio.wait({waiting}, timeout=DEADLINE_SEC)
    assert waiting.done()
    assert not waiting.cancelled()
    if end is destroy:
        await leave(node)
    return waiting.exception() or waiting.result()


@END
@pytest.mark.parametrize("wait", WAITS)
async def test_a_wait_raises_node_destroyed_when_its_node_ends(
    meeting: Meeting, wait: str, end: Callable[..., Any]
) -> None:
    """Not CancelledError, in a task that nobody has cancelled: a TaskGroup would not report it."""
    node = meeting.absent("one", stop_timeout_sec=0.1)
    await node.__aenter__()
    error = await ended_wait(node, WAITS[wait](node), end)
    assert isinstance(error, actors.NodeDestroyed | actors.ServiceUnavailable), error


@END
@pytest.mark.parametrize("wait", UNCONNECTED)
async def test_a_wait_for_a_broker_ends_with_its_node(wait: str, end: Callable[..., Any]) -> None:
    """It raises a typed error, too, where there has never been a session."""
    node = actors.Node("one", url=NO_BROKER, use_global_arguments=False, stop_timeout_sec=0.1, **BARE)
    await node.__aenter__()
    error = await ended_wait(node, UNCONNECTED[wait](node), end)
    assert isinstance(error, actors.NodeDestroyed | actors.ServiceUnavailable | actors.BrokerUnreachable), (
        error
    )


@END
@pytest.mark.parametrize("items", ITERATIONS)
async def test_an_iteration_ends_quietly_with_its_node(
    meeting: Meeting, items: str, end: Callable[..., Any]
) -> None:
    """A program that reads until the end has nothing to catch."""
    node = meeting.absent("one", stop_timeout_sec=0.1)
    await node.__aenter__()
    assert await ended_wait(node, first(ITERATIONS[items](node)), end) == "ended"


async def test_iterating_over_a_destroyed_subscription_is_an_error(meeting: Meeting) -> None:
    """It would end at once, as if there were nothing to read."""
    node = await meeting.node("one")
    subscription = node.create_subscription(String, "quiet")
    subscription.destroy()
    with pytest.raises(actors.NodeDestroyed):
        await first(aiter(subscription))


async def test_a_task_group_reports_a_call_whose_client_was_destroyed(meeting: Meeting) -> None:
    """The failure is raised where the group ends."""
    node = await meeting.node("one")
    node.create_service(AddTwoInts, "add", for_ever, concurrent=True)
    client = node.create_client(AddTwoInts, "add")
    await client.wait_for_service()
    with pytest.raises(ExceptionGroup) as caught:  # noqa: PT012 - the group raises at its end
        async with asyncio.TaskGroup() as group:
            group.create_task(client.call(AddTwoInts.Request()))
            await until(lambda: client.pending)
            client.destroy()
    assert isinstance(caught.value.exceptions[0], actors.NodeDestroyed)


async def test_calls_that_nobody_awaits_end_in_silence(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """asyncio does not report the errors of futures that nobody awaits when their client is destroyed."""
    node = await meeting.node("one")
    node.create_service(AddTwoInts, "add", for_ever, concurrent=True)
    client = node.create_client(AddTwoInts, "add")
    await client.wait_for_service()
    client.call_async(AddTwoInts.Request())
    client.destroy()
    await turns()
    assert not [record for record in caplog.records if record.name == "asyncio"]
