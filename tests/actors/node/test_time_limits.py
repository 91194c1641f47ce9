"""How long waits of a node last that name no limit, or None."""

from __future__ import annotations

import asyncio
import inspect
from typing import TYPE_CHECKING, Any, Final

import pytest

import actors
from actors.interfaces.action_tutorials_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tests.actors.meeting import Meeting

LIMIT_SEC: Final = 0.05


async def for_ever(_: object) -> Any:
    await asyncio.Event().wait()


async def call(node: actors.Node, **limit: None) -> Any:
    """Call a server that never answers."""
    client = node.create_client(AddTwoInts, "add")
    await client.wait_for_service(DEADLINE_SEC)
    return await client.call(AddTwoInts.Request(), **limit)


async def send_goal(node: actors.Node, **limit: None) -> Any:
    client = node.create_action_client(Fibonacci, "undecided")
    await client.wait_for_server(DEADLINE_SEC)
    return await client.send_goal(
        Fibonacci.Goal(), timeout_sec=limit.get("timeout_sec", actors.DEFAULT_TIMEOUT)
    )


async def result(node: actors.Node, **limit: None) -> Any:
    client = node.create_action_client(Fibonacci, "endless")
    await client.wait_for_server(DEADLINE_SEC)
    return await (await client.send_goal(Fibonacci.Goal(), timeout_sec=DEADLINE_SEC)).result(**limit)


async def get_result(node: actors.Node, **limit: None) -> Any:
    client = node.create_action_client(Fibonacci, "endless")
    await client.wait_for_server(DEADLINE_SEC)
    handle = await client.send_goal(Fibonacci.Goal(), timeout_sec=DEADLINE_SEC)
    return await client.get_result(handle.goal_id, **limit)


async def ready(node: actors.Node, **limit: None) -> Any:
    publisher = node.create_publisher(String, "unread", KEEP_ALL)
    await publisher.wait_for_subscriptions(1, DEADLINE_SEC)
    try:
        while True:
            publisher.publish(String(data="x" * 100_000))
    except actors.PublisherFull:
        return await publisher.ready(**limit)


WAITS: Final[dict[str, tuple[Callable[..., Awaitable[Any]], object]]] = {
    "call": (call, actors.ServiceTimeout),
    "wait_for_service": (
        lambda node, **limit: node.create_client(AddTwoInts, "absent").wait_for_service(**limit),
        False,
    ),
    "wait_for_services": (
        lambda node, **limit: actors.ParameterClient(node, "absent").wait_for_services(**limit),
        False,
    ),
    "wait_for_server": (
        lambda node, **limit: node.create_action_client(Fibonacci, "absent").wait_for_server(**limit),
        False,
    ),
    "send_goal": (send_goal, actors.ServiceTimeout),
    "result": (result, actors.WaitTimeout),
    "get_result": (get_result, actors.WaitTimeout),
    "ready": (ready, actors.WaitTimeout),
    "wait_for_subscriptions": (
        lambda node, **limit: node.create_publisher(String, "quiet").wait_for_subscriptions(**limit),
        actors.WaitTimeout,
    ),
    "wait_for_message": (
        lambda node, **limit: actors.wait_for_message(String, node, "quiet", **limit),
        actors.WaitTimeout,
    ),
    "wait_for_node": (lambda node, **limit: node.wait_for_node("/absent", **limit), False),
}


async def outcome(wait: Awaitable[Any]) -> object:
    """Return the type of a wait's error, or its result."""
    try:
        return await wait
    except actors.CallboardError as error:
        return type(error)


@pytest.mark.parametrize("name", WAITS)
async def test_an_omitted_limit_is_the_nodes_and_none_is_none(meeting: Meeting, name: str) -> None:
    """The wait without a limit goes on when the one with the node's has ended."""
    other = await meeting.node("other", stop_timeout_sec=0.1)
    other.create_service(AddTwoInts, "add", for_ever, concurrent=True)
    other.create_action_server(Fibonacci, "undecided", for_ever, goal_callback=for_ever)
    other.create_action_server(Fibonacci, "endless", for_ever)
    other.create_subscription(String, "unread", qos_profile=KEEP_ALL)
    node = await meeting.node("one", default_call_timeout_sec=LIMIT_SEC, stop_timeout_sec=0.1)
    wait, end = WAITS[name]
    endless = asyncio.ensure_future(wait(node, timeout_sec=None))
    async with asyncio.timeout(DEADLINE_SEC):
        assert await outcome(wait(node)) == end
    assert not endless.done()
    endless.cancel()


def test_the_sentinel_shows_its_name() -> None:
    """Signatures in documents and editors are readable."""
    signature = inspect.signature(actors.Client.wait_for_service)
    assert "timeout_sec: 'Timeout' = DEFAULT_TIMEOUT" in str(signature)
