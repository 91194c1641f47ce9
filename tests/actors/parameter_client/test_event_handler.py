"""Callbacks for the parameters of any node."""

from __future__ import annotations

import asyncio
import inspect
from typing import TYPE_CHECKING, Any

import pytest

from actors import Parameter, ParameterDescriptor, ParameterEventHandler
from actors.interfaces.rcl_interfaces import msg
from tests.actors.meeting import matched, until
from tests.seams.nodes import subscription_of

if TYPE_CHECKING:
    from collections.abc import Coroutine

    import actors
    from tests.actors.meeting import Meeting


@pytest.fixture
async def server(meeting: Meeting) -> actors.Node:
    return await meeting.node("server", namespace="ns", start_parameter_services=True)


@pytest.fixture
async def watcher(meeting: Meeting, server: actors.Node) -> actors.Node:
    return await meeting.node("watcher", namespace="ns")


@pytest.fixture
async def handler(watcher: actors.Node) -> ParameterEventHandler:
    made = ParameterEventHandler(watcher)
    await matched(subscription_of(made))
    return made


async def test_one_parameter_of_one_node(
    meeting: Meeting, server: actors.Node, handler: ParameterEventHandler
) -> None:
    """New and changed values of that node's parameter, and no others."""
    seen: list[Any] = []
    handle = handler.add_parameter_callback("a", "/ns/server", lambda given: seen.append(given.value))
    other = await meeting.node("other", start_parameter_services=True)
    other.declare_parameter("a", -1)
    await meeting.settled(other)
    server.declare_parameter("b", -2)
    server.declare_parameter("a", 1)
    server.set_parameters([Parameter("a", value=2)])
    await until(lambda: seen == [1, 2])
    handler.remove_parameter_callback(handle)
    with pytest.raises(ValueError, match="not in list"):
        handler.remove_parameter_callback(handle)
    server.set_parameters([Parameter("a", value=3)])
    last = handler.add_parameter_callback("a", "server", lambda given: seen.append(given.value))
    server.set_parameters([Parameter("a", value=4)])
    await until(lambda: 4 in seen)
    assert last.node_name == "/ns/server"


async def test_all_events(server: actors.Node, handler: ParameterEventHandler) -> None:
    """Event callbacks get removals, too."""
    events: list[msg.ParameterEvent] = []
    handle = handler.add_parameter_event_callback(events.append)
    server.declare_parameter("a", 1, ParameterDescriptor(dynamic_typing=True))
    server.set_parameters([Parameter("a")])
    await until(lambda: len(events) == 2)
    assert handler.get_parameter_from_event(events[0], "a", "/ns/server") == Parameter("a", value=1)
    assert handler.get_parameter_from_event(events[0], "a", "/ns/other") is None
    assert [each.name for each in events[1].deleted_parameters] == ["a"]
    handler.remove_parameter_event_callback(handle)
    with pytest.raises(ValueError, match="not in list"):
        handler.remove_parameter_event_callback(handle)


async def test_callbacks_may_be_coroutines_and_raise(
    server: actors.Node, watcher: actors.Node, handler: ParameterEventHandler
) -> None:
    """The last one added is called first; an error in one keeps no other from running, and is counted."""
    seen: list[str] = []

    async def later(given: Parameter) -> None:
        seen.append("coroutine")
        raise OSError

    def boom(given: Parameter) -> None:
        seen.append("boom")
        raise ValueError

    handler.add_parameter_callback("a", "/ns/server", later)
    handler.add_parameter_callback("a", "/ns/server", boom)
    handler.add_parameter_callback("a", "/ns/server", lambda _: seen.append("last"))
    server.declare_parameter("a", 1)
    await until(lambda: watcher.callback_errors)
    assert seen == ["last", "boom", "coroutine"]


async def test_a_node_that_ends_closes_the_coroutines_that_wait(
    server: actors.Node, watcher: actors.Node, handler: ParameterEventHandler
) -> None:
    """If the callback that runs is cancelled, those after it are closed instead of forgotten."""
    entered = asyncio.Event()
    waiting: list[Coroutine[Any, Any, None]] = []

    async def endless() -> None:
        entered.set()
        await asyncio.Event().wait()

    def call(given: Parameter) -> Coroutine[Any, Any, None]:
        waiting.append(endless())
        return waiting[-1]

    for _ in range(2):
        handler.add_parameter_callback("a", "/ns/server", call)
    server.declare_parameter("a", 1)
    await entered.wait()
    watcher.destroy_node()
    await until(lambda: all(inspect.getcoroutinestate(each) == inspect.CORO_CLOSED for each in waiting))


async def test_the_own_node(meeting: Meeting) -> None:
    """An empty name is the node's own; a destroyed handler calls nothing."""
    node = await meeting.node("self", start_parameter_services=True)
    handler = ParameterEventHandler(node)
    seen: list[Any] = []
    handler.add_parameter_callback("a", "", lambda given: seen.append(given.value))
    await matched(subscription_of(handler))
    node.declare_parameter("a", 1)
    await until(lambda: seen == [1])
    handler.destroy()
    node.set_parameters([Parameter("a", value=2)])
    await meeting.settled(node)
    assert seen == [1]


def test_unknown_types_are_left_out() -> None:
    """An event of another implementation may have any types."""
    odd = msg.Parameter(name="odd", value=msg.ParameterValue(type=77))
    event = msg.ParameterEvent(node="/n", new_parameters=[odd, Parameter("a", value=1).to_parameter_msg()])
    assert ParameterEventHandler.get_parameters_from_event(event) == [Parameter("a", value=1)]
