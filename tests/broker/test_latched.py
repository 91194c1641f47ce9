"""Latched messages have limits in bytes, and messages that late joiners miss for it are counted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker import latched
from proto import frames
from proto.batches import held_bytes
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

if TYPE_CHECKING:
    import pytest

MANY: frames.Options = {**make.LATCHED, "depth": 100}


def heard_late(switch: Switch, topic: str = "/t", node: str = "/late") -> list[int]:
    """Return the numbers of the messages that a new subscription gets."""
    listener = switch.join(node)
    switch.send(listener, make.subscription(1, topic, qos=MANY))
    return [
        number
        for replay in switch.read(listener, frames.Replay)
        for number in range(replay.first_sequence, replay.first_sequence + replay.length)
    ]


def test_the_depth_counts_messages_and_misses_none() -> None:
    """Beyond the depth the oldest are dropped, also within a batch; they do not count as missed."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos={**make.LATCHED, "depth": 5}))
    switch.send(talker, make.batch(number, 0, 4), make.batch(number, 4, 3))
    assert heard_late(switch) == [2, 3, 4, 5, 6]
    assert switch.router.routes.latched_dropped == 0


def test_the_bytes_of_a_publisher_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest batches are dropped, and each message within the depth is counted."""
    monkeypatch.setattr(latched, "LATCHED_BYTES", 2 * held_bytes(make.batch(1, 0, 4)))
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos=MANY))
    switch.send(talker, *(make.batch(number, first, 4) for first in (0, 4, 8)))
    assert heard_late(switch) == [4, 5, 6, 7, 8, 9, 10, 11]
    routes = switch.router.routes
    assert [topic.latched_dropped for topic in switch.router.topics.records()] == [4]
    assert routes.latched_dropped == 4
    switch.send(talker, make.batch(number, 12, 11, size=200))
    assert (heard_late(switch, node="/later"), routes.latched_dropped) == ([], 4 + 8 + 11)


def test_the_bytes_of_a_link_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A publisher beyond it loses its oldest messages; bytes that another frees can be used again."""
    monkeypatch.setattr(latched, "LATCHED_BYTES_PER_LINK", 2 * held_bytes(make.batch(1, 0, 7)))
    switch = Switch()
    talker = switch.join("/talker")
    first = switch.publisher(talker, make.publisher(1, "/a", qos=MANY))
    second = switch.publisher(talker, make.publisher(2, "/b", qos=MANY))
    switch.send(talker, make.batch(first, 0, 7), make.batch(second, 0, 2), make.batch(second, 2, 2))
    assert heard_late(switch, "/a") == list(range(7))
    assert (heard_late(switch, "/b", "/later"), switch.router.routes.latched_dropped) == ([2, 3], 2)
    switch.send(talker, frames.Undeclare(1), make.batch(second, 4, 8))
    assert heard_late(switch, "/b", "/last") == [2, 3, *range(4, 12)]
