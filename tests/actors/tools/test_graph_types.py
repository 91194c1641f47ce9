"""The classes of what a graph carries, installed or not."""

from __future__ import annotations

import json
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.action import action_types
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.message import Message, definition, type_hash, type_name
from actors.interfaces.runtime_types import runtime_action
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Empty
from actors.tools.graph_types import GraphTypes

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting


class Tree(Message, type_name="graph_types_test/msg/Tree"):
    """A type that contains itself, which only its author's class can be."""

    children: list[Tree] = []  # noqa: RUF012 - msgspec copies it


def _foreign(cls: Any) -> bytes:
    """Return the definition of a type as if its package had another name."""
    whole: Any = json.loads(definition(cls).replace(b'"example_interfaces/', b'"elsewhere/'))
    whole["referenced_type_descriptions"].sort(key=itemgetter("type_name"))
    return json.dumps(whole).encode()


async def test_installed_classes_are_used(meeting: Meeting) -> None:
    """Of topics, services and actions, as declared by one side or the other."""
    node = await meeting.node("server")
    node.create_subscription(String, "chatter", lambda _: None)
    node.create_service(Empty, "clear", lambda _, response: response)
    node.create_action_server(Fibonacci, "count", lambda _: Fibonacci.Result())
    types, graph = GraphTypes(node), await node.get_graph()
    assert await types.message(graph, "/chatter") is String
    assert await types.service(graph, "/clear") is Empty
    assert await types.action(graph, "/count") is Fibonacci


async def test_an_action_that_is_not_installed_can_be_used(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A goal goes to its server and its result comes back; the class is made once."""
    derived = action_types(Fibonacci)
    parts = (derived.send_goal, derived.get_result, derived.feedback_message)
    foreign: Any = runtime_action(*map(_foreign, parts))
    server, node = await meeting.node("server"), await meeting.node("client")

    def execute(goal: Any) -> Any:
        goal.succeed()
        return foreign.Result(sequence=[goal.request.order])

    server.create_action_server(foreign, "count", execute)
    await meeting.settled(server, node)
    # Not even the server's own is found.
    monkeypatch.setattr("actors.tools.graph_types.installed_interface", lambda _: None)
    types, graph = GraphTypes(node), await node.get_graph()
    found: Any = await types.action(graph, "/count")
    assert type_name(found) == "elsewhere/action/Fibonacci"
    assert found is not foreign
    again: Any = await types.action(graph, "/count")
    assert again is found
    client: actors.ActionClient[Any, Any, Any] = node.create_action_client(found, "count")
    assert await client.wait_for_server(10.0)
    ended = await (await client.send_goal(found.Goal(order=3))).result(10.0)
    assert list(ended.result.sequence) == [3]


async def test_which_type_is_meant_must_be_clear(meeting: Meeting) -> None:
    """Of several the caller chooses; an unused topic needs one; another kind of type is none."""
    node = await meeting.node("talker")
    node.create_subscription(String, "both", lambda _: None)
    node.create_subscription(Int32, "both", lambda _: None)
    types, graph = GraphTypes(node), await node.get_graph()
    with pytest.raises(UnknownInterfaceError, match="say which"):
        await types.message(graph, "/both")
    assert await types.message(graph, "/both", "std_msgs/msg/Int32") is Int32
    with pytest.raises(UnknownInterfaceError, match="/new"):
        await types.message(graph, "/new")
    assert await types.message(graph, "/new", "std_msgs/msg/String") is String
    with pytest.raises(UnknownInterfaceError, match="no message"):
        await types.message(graph, "/new", "std_srvs/srv/Empty")


async def test_a_definition_is_known_as_long_as_somebody_uses_the_type(meeting: Meeting) -> None:
    """To every node, by its hash; nobody knows that of another type."""
    node, other = await meeting.node("talker"), await meeting.node("listener")
    node.create_publisher(Tree, "trees", 1)
    await meeting.settled(node)
    assert await other.get_type_definition(type_hash(Tree)) == definition(Tree)
    assert await other.get_type_definition(f"RIHS01_{'0' * 64}") is None


async def test_a_type_that_cannot_be_made_is_tried_once(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A class is never freed, so a hostile definition must not be tried with each request."""
    node = await meeting.node("talker")
    node.create_publisher(Tree, "trees", 1)
    monkeypatch.setattr("actors.tools.graph_types.installed_interface", lambda _: None)
    types, graph = GraphTypes(node), await node.get_graph()
    with pytest.raises(InvalidMessageError, match="contains itself"):
        await types.message(graph, "/trees")
    monkeypatch.setattr(node, "get_type_definition", None)
    with pytest.raises(InvalidMessageError, match="contains itself"):
        await types.message(graph, "/trees")
