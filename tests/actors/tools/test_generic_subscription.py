"""A topic is read as well as is possible, whatever is known of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import actors
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import MessageBudgetError
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.tools.generic_subscription import decoder_of, profile_of
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from tests.actors.meeting import latched
from tests.hostile.decode_bytes import starved

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


HELLO = codec_for(String).encode(String(data="hello"))


async def test_a_known_type_is_read_as_its_class(meeting: Meeting) -> None:
    """And a message of another type, which may come, as a dict."""
    node = await meeting.node("talker")
    node.create_publisher(String, "t", 1)
    decode = decoder_of(await node.get_graph(), "/t")
    assert decode(HELLO) == String(data="hello")
    assert decode(codec_for(Int32).encode(Int32(data=3))) == {"data": 3}


@pytest.mark.parametrize("types", [["std_msgs/msg/String", "std_msgs/msg/Int32"], ["nowhere/msg/This"], []])
def test_what_is_not_known_for_certain_is_read_as_dicts(types: list[str]) -> None:
    """Two types on a topic, a type that is not at hand, no endpoint at all."""
    entries = [
        GraphEntry(key, EntryKind.PUBLISHER, "/n", "/t", name, "RIHS01_0", {})
        for key, name in enumerate(types)
    ]
    snapshot = GraphSnapshot(entries={entry.key: entry for entry in entries})
    assert decoder_of(snapshot, "/t")(HELLO) == {"data": "hello"}


def test_another_definition_of_a_known_type_is_read_as_dicts() -> None:
    """The class at hand has the name, and not the hash."""
    entry = GraphEntry(1, EntryKind.PUBLISHER, "/n", "/t", "std_msgs/msg/String", "RIHS01_0", {})
    assert decoder_of(GraphSnapshot(entries={1: entry}), "/t")(HELLO) == {"data": "hello"}


async def test_the_profile_takes_what_is_offered(meeting: Meeting) -> None:
    """Best effort if any publisher is; latched if all are."""
    node = await meeting.node("talker")
    loose = actors.QoSProfile(depth=3, reliability=actors.ReliabilityPolicy.BEST_EFFORT)
    kept = latched(5)
    offers: list[tuple[str, actors.QoSProfile | int]] = [
        *(("plain", 1), ("loose", 1), ("loose", loose)),
        *(("latched", kept), ("half_latched", kept), ("half_latched", 1)),
    ]
    for topic, qos in offers:
        node.create_publisher(String, topic, qos)
    snapshot = await node.get_graph()

    def policies(topic: str) -> tuple[int, str, str]:
        profile = profile_of(snapshot, topic, depth=7)
        return profile.depth, profile.reliability.name, profile.durability.name

    assert policies("/plain") == policies("/nowhere") == (7, "RELIABLE", "VOLATILE")
    assert policies("/loose") == (7, "BEST_EFFORT", "VOLATILE")
    assert policies("/latched") == (7, "RELIABLE", "TRANSIENT_LOCAL")
    assert policies("/half_latched") == (7, "RELIABLE", "VOLATILE")


async def test_what_a_class_refuses_is_not_read_as_a_dict(meeting: Meeting) -> None:
    """Case 62: its empty maps would be within the budget, and shown as messages."""
    node = await meeting.node("talker")
    node.create_publisher(TFMessage, "t", 1)
    decode = decoder_of(await node.get_graph(), "/t")
    with pytest.raises(MessageBudgetError):
        decode(starved("transforms", 40_000))
