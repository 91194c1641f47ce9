"""What the live view gets from a real broker."""

from __future__ import annotations

import array
import asyncio
from typing import TYPE_CHECKING

import msgpack
import pytest

from actors.cli.commands.top.source import SHOWN_AT_ONCE, SHOWN_LENGTH, SHOWN_LINES, NodeSource, shown
from actors.errors import BrokerUnreachable
from actors.interfaces.codec import codec_for, decode_untyped
from actors.interfaces.std_msgs.msg import String
from actors.threads import NodeThread
from tests.actors.meeting import latched, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from actors.cli.commands.top.source import Received, ReceivedMessage, TopicReader
    from tests.actors.meeting import Meeting


@pytest.fixture
async def source(meeting: Meeting) -> AsyncIterator[NodeSource]:
    """The data from a node in a thread of its own."""
    with NodeThread() as thread:
        node = await asyncio.to_thread(thread.enter, meeting.absent("_observer"))
        yield NodeSource(thread, node, "here")
        await asyncio.to_thread(thread.stop)


async def take_messages(reader: TopicReader, count: int) -> tuple[list[ReceivedMessage], Received]:
    """Take until so many messages have come, shown or not."""
    messages: list[ReceivedMessage] = []
    known = 0

    async def enough() -> Received:
        nonlocal known
        while True:
            received = await reader.pop()
            messages.extend(received.messages)
            known += len(received.messages) + received.besides
            if known >= count:
                assert known == count
                return received

    return messages, await enough()


async def test_a_sample_is_of_the_other_nodes(meeting: Meeting, source: NodeSource) -> None:
    """The observing node and its subscriptions are not in it."""
    talker = await meeting.node("talker")
    talker.create_publisher(String, "chatter", 10)
    reader = await source.listen("/chatter", await talker.get_graph())
    sample = await source.sample()
    assert sample.snapshot.nodes() == ["/talker"]
    assert {entry.node for entry in sample.snapshot.entries.values()} == {"/talker"}
    assert sample.report.totals.connections == 2
    await reader.close()


async def test_messages_are_received_with_where_they_are_from(meeting: Meeting, source: NodeSource) -> None:
    """Their text, their publisher's node and how long they took; after the end none."""
    talker = await meeting.node("talker")
    publisher = talker.create_publisher(String, "chatter", 10)
    reader = await source.listen("/chatter", await talker.get_graph())
    await until(lambda: publisher.get_subscription_count() == 1)
    assert await reader.pop() == ([], 0, 0, None, None)
    publisher.publish(String(data="hello"))
    (message,), received = await take_messages(reader, 1)
    assert (message.node, message.text, received.measured) == ("/talker", "data: hello", 1)
    assert received.p50_s == received.p99_s == message.delay_s
    await reader.close()
    await until(lambda: publisher.get_subscription_count() == 0)


async def test_only_the_newest_are_read(meeting: Meeting, source: NodeSource) -> None:
    """Whatever comes on top of what one can read is counted."""
    talker = await meeting.node("talker")
    publisher = talker.create_publisher(String, "chatter", 1000)
    reader = await source.listen("/chatter", await talker.get_graph())
    await until(lambda: publisher.get_subscription_count() == 1)
    for number in range(50):
        publisher.publish(String(data=str(number)))
    messages, received = await take_messages(reader, 50)
    assert messages[-1].text == "data: '49'"
    assert received.besides == 50 - SHOWN_AT_ONCE
    assert received.measured == 50


async def test_a_latched_message_has_no_delay(meeting: Meeting, source: NodeSource) -> None:
    """It is as old as it is, which says nothing of the way."""
    talker = await meeting.node("talker")
    talker.create_publisher(String, "map", latched(1)).publish(String(data="old"))
    reader = await source.listen("/map", await talker.get_graph())
    (message,), received = await take_messages(reader, 1)
    assert (message.text, received.measured, received.p50_s) == ("data: old", 0, None)


async def test_a_lost_broker_is_reported_at_once(meeting: Meeting, source: NodeSource) -> None:
    """Without waiting for the node, which comes back by itself."""
    await source.sample()
    await meeting.stop_broker()

    async def sample_until_it_fails() -> None:
        while True:
            await source.sample()

    with pytest.raises(BrokerUnreachable):
        await sample_until_it_fails()
    with pytest.raises(BrokerUnreachable, match=f"No broker at {meeting.url}"):
        await source.sample()


def test_long_messages_are_cut() -> None:
    """In length and in lines; a screen cannot be steered."""
    text = shown(codec_for(String).encode(String(data="x" * 500)), decode_untyped)
    assert text == f"data: {'x' * SHOWN_LENGTH}..."
    lines = shown(
        msgpack.packb({f"field_{number}": number for number in range(100)}), decode_untyped
    ).splitlines()
    assert len(lines) == SHOWN_LINES + 1
    assert lines[-1] == f"... {100 - SHOWN_LINES} more lines"
    assert "\x1b" not in shown(codec_for(String).encode(String(data="\x1b[2J")), decode_untyped)


def test_long_arrays_are_described() -> None:
    """Short ones are shown."""
    for size, lines in ((2, ["width: 2", "data:", "- 1", "- 1"]), (100, ["width: 100"])):
        text = shown(msgpack.packb({"width": size, "data": [1] * size}), decode_untyped)
        assert text.splitlines()[: len(lines)] == lines
    assert "length: 100" in text


def test_what_is_no_message_is_reported() -> None:
    """The screen shows why."""
    assert "Not a message" in shown(array.array("B", [0xC1]).tobytes(), decode_untyped)
    assert "Not a message" in shown(b"\x81\xa4data" + b"\x91" * 300 + b"\xc0", decode_untyped)
