"""The text of an interface, wherever it is."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import msgspec
import pytest

import actors
from actors.graph.inspector import Inspector
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import Action, Message, Service, type_hash, type_name
from actors.interfaces.std_msgs.msg import String
from actors.tools.definitions import class_in_graph, full_name, local_text, texts_in_graph

if TYPE_CHECKING:
    from pathlib import Path

    from broker import Broker


class Finger(Message, type_name="definitions_test/msg/Finger"):
    """A message that only another one contains."""

    length: float = 0.0


class Hand(Message, type_name="definitions_test/msg/Hand"):
    """A message that contains messages."""

    fingers: list[Finger] = msgspec.field(default_factory=list)
    name: str = ""


class Wave(Service, type_name="definitions_test/srv/Wave"):
    """A service."""

    class Request(Message):
        """The request."""

        hand: Hand

    class Response(Message):
        """The response."""

        seen: bool = False


class Grip(Action, type_name="definitions_test/action/Grip"):
    """An action."""

    class Goal(Message):
        """The goal."""

        hand: Hand

    class Result(Message):
        """The result."""

    class Feedback(Message):
        """The feedback."""

        force: float = 0.0


HAND = "definitions_test/Finger[] fingers\nstring name\n"


async def _asked(broker: Broker, name: str) -> dict[str, str]:
    def ask() -> dict[str, str]:
        with Inspector(broker.url) as look:
            return texts_in_graph(look, name)

    return await asyncio.to_thread(ask)


async def test_a_type_that_a_node_has_declared(broker: Broker) -> None:
    """Its text, and those of what it contains."""
    async with actors.Node("one", url=broker.url) as node:
        node.create_publisher(String, "other")
        node.create_publisher(Hand, "hands")
        await node.get_graph()
        texts = await _asked(broker, "definitions_test/msg/Hand")
    assert texts["definitions_test/msg/Hand"] == HAND
    assert texts["definitions_test/msg/Finger"] == "float64 length\n"


async def test_a_type_that_is_only_contained(broker: Broker) -> None:
    """Found in the definition of what contains it, here a service's."""
    async with actors.Node("one", url=broker.url) as node:
        node.create_service(Wave, "wave", lambda request: Wave.Response())
        await node.get_graph()
        texts = await _asked(broker, "definitions_test/msg/Finger")
        assert texts["definitions_test/msg/Finger"] == "float64 length\n"
        assert (await _asked(broker, "definitions_test/srv/Wave"))["definitions_test/srv/Wave"] == (
            "definitions_test/Hand hand\n---\nbool seen\n"
        )


async def test_classes_of_types_that_nodes_use(broker: Broker) -> None:
    """Of messages, also contained ones, services and actions; they match those of the node."""

    def ask() -> list[Any]:
        names = ("msg/Hand", "msg/Finger", "srv/Wave", "action/Grip", "msg/None", "none/None")
        with Inspector(broker.url) as look:
            return [class_in_graph(look, f"definitions_test/{name}") for name in names]

    async with actors.Node("one", url=broker.url) as node:
        node.create_service(Wave, "wave", lambda request: Wave.Response())
        node.create_action_server(Grip, "grip", lambda handle: Grip.Result())
        await node.get_graph()
        hand, finger, wave, grip, *none = await asyncio.to_thread(ask)
    assert none == [None, None]
    for made, own in ((hand, Hand), (finger, Finger), (wave, Wave), (grip.Goal, Grip.Goal)):
        assert (type_name(made), type_hash(made)) == (type_name(own), type_hash(own))


async def test_a_type_that_nobody_uses(broker: Broker) -> None:
    """Nothing is found."""
    assert await _asked(broker, "definitions_test/msg/Hand") == {}


def test_local_texts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file with its comments goes before the class; a class needs no file; the kind may be left out."""
    (tmp_path / "definitions_files" / "srv").mkdir(parents=True)
    (tmp_path / "definitions_files" / "srv" / "Stop.srv").write_text("# now\n---\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert full_name("definitions_files/Stop") == "definitions_files/srv/Stop"
    assert local_text("definitions_files/srv/Stop") == "# now\n---\n"
    assert full_name("std_msgs/String") == "std_msgs/msg/String"
    assert local_text("std_msgs/msg/String") == "string data\n"
    assert local_text("definitions_test/msg/Hand") == HAND
    assert local_text("definitions_files/srv/Go") is None


@pytest.mark.parametrize("name", ["", "x", "a/b/c/d", "nope/msg/Zzzz", "definitions_files/Qqq"])
def test_unknown_names(name: str) -> None:
    """A typed error, whatever was typed."""
    with pytest.raises(UnknownInterfaceError):
        full_name(name)
