"""Which messages wait for a reader, how many, and how they are decoded."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, cast

import pytest

from actors.endpoints.subscription.backlog import MessageInfo
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.codec import codec_for
from actors.interfaces.std_msgs.msg import String
from actors.web import topic_feed
from actors.web.topic_feed import MAX_BYTES, NewestMessages, Received, TopicFeeds
from proto.errors import InvalidTopicNameError
from tests.actors.meeting import latched, until

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.node.node import Node
    from actors.web.topic_feed import TopicReader
    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site

INFO = MessageInfo(0, 0, 0, b"", "/talker")


def test_the_oldest_makes_room() -> None:
    """By number; each call says how many have."""
    queue = NewestMessages(2)
    assert [queue.add(Received(bytes([each]), INFO)) for each in range(4)] == [0, 0, 1, 1]
    assert [each.data for each in queue] == [b"\x02", b"\x03"]


def test_the_newest_is_kept_whatever_its_size() -> None:
    """By size: the others make room for it."""
    queue = NewestMessages(100)
    for _ in range(3):
        queue.add(Received(bytes(1000), INFO))
    assert queue.add(Received(bytes(MAX_BYTES + 1), INFO)) == 3
    assert len(queue) == 1


class LateObserver:
    """Knows an empty graph, until a test looks at it."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self._snapshot = GraphSnapshot()
        self.listeners: list[Callable[[], None]] = []

    def around(self, _: str) -> GraphSnapshot:
        return self._snapshot

    def on_graph(self, listener: Callable[[], None]) -> Callable[[], None]:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener)

    async def look(self) -> None:
        self._snapshot = await self.node.get_graph()
        for listener in self.listeners:
            listener()


async def test_a_reader_gets_a_latched_message_once(meeting: Meeting) -> None:
    """It is opened before the topic is in the graph, and so subscribes again; another one has had nothing."""
    observer = LateObserver(await meeting.node("page"))
    feeds, woken = TopicFeeds(cast("Any", observer)), asyncio.Event()
    decode = codec_for(String).decode

    async def newest(reader: TopicReader, last: str) -> list[str]:
        found: list[str] = []
        while last not in found:
            await woken.wait()
            woken.clear()
            found += [decode(each.data).data for each in reader.pop()]
        return found

    first = feeds.read("/chatter", 10, woken.set)
    publisher = (await meeting.node("talker")).create_publisher(String, "chatter", latched(2))
    await until(publisher.get_subscription_count)
    publisher.publish(String(data="kept"))
    assert await newest(first, "kept") == ["kept"]
    second = feeds.read("/chatter", 10, woken.set)
    await observer.look()
    publisher.publish(String(data="new"))
    assert await newest(first, "new") == ["new"]
    assert [decode(each.data).data for each in second.pop()] == ["kept", "new"]
    for reader in (first, second):
        reader.close()


async def test_a_name_that_breaks_the_rules_leaves_nothing(meeting: Meeting) -> None:
    """Otherwise each attempt of a client would cost memory, and time at each change of the graph."""
    observer = LateObserver(await meeting.node("page"))
    with pytest.raises(InvalidTopicNameError):
        TopicFeeds(cast("Any", observer)).read("/a b", 10, lambda: None)
    assert not observer.listeners


async def test_a_change_of_the_graph_while_a_decoder_is_made(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread makes it of the old graph, which may lack the type; the next message gets another."""
    listeners: list[Callable[[], None]] = []
    observer = site.observer

    def on_graph(listener: Callable[[], None]) -> Callable[[], None]:
        listeners.append(listener)
        return lambda: None

    monkeypatch.setattr(observer, "on_graph", on_graph)
    made = 0

    def decoder_of(*_: object) -> Callable[[bytes], int]:
        nonlocal made
        made += 1
        if made == 1:
            observer.snapshot = GraphSnapshot()
            for listener in listeners:
                listener()
        number = made
        return lambda _: number

    monkeypatch.setattr(topic_feed, "decoder_of", decoder_of)
    reader = TopicFeeds(observer).read("/chatter", 1, lambda: None)
    assert [reader.decode(b"") for _ in range(3)] == [1, 2, 2]
    reader.close()
