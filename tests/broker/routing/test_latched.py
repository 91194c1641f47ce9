"""Latched messages have limits in bytes, and messages that late joiners miss for it are counted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing import latched
from proto.queues.batches import held_bytes, with_raw
from proto.wire import frames
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
    assert [topic.latched_dropped for topic in switch.router.topics.by_name.values()] == [4]
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


def lifespan_of(seconds: int) -> frames.Options:
    return {**MANY, "lifespan_ns": seconds * 10**9}


def stamped(publisher: int, first: int, second: int) -> frames.Batch:
    """Return a batch of two messages that was sent at a second of the publisher's clock."""
    return with_raw(make.batch(publisher, first, 2)._replace(stamp_ns=second * 10**9, raw=b""))


def test_a_new_message_drops_those_that_have_expired() -> None:
    """By the stamps of their publisher; their memory is free, and nobody has missed them."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos=lifespan_of(10)))
    switch.send(talker, *(stamped(number, 2 * second, second) for second in (0, 5, 10)))
    assert heard_late(switch) == [0, 1, 10, 11, 20, 21]
    switch.send(talker, stamped(number, 32, 16))
    assert heard_late(switch, node="/later") == [20, 21, 32, 33]
    (publisher,) = switch.router.routes.publishers.values()
    assert publisher.latched_bytes == publisher.peer.latched_bytes == 2 * held_bytes(make.batch(1, 0, 2))
    assert switch.router.routes.latched_dropped == 0


def test_messages_of_a_silent_publisher_expire() -> None:
    """In the periodic check, whatever the publisher's clock shows; those without a lifespan stay."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos=lifespan_of(10)))
    other = switch.publisher(talker, make.publisher(2, "/forever", qos=MANY))
    switch.send(talker, stamped(number, 0, 1_000), stamped(number, 10, 1_006), stamped(other, 0, 0))
    routes = switch.router.routes
    publisher = next(each for each in routes.publishers.values() if each.key == number)
    kept: list[int] = []
    for now in (50, 54, 55, 60, 61):  # the newest has been there since 50 at least
        routes.latched_expiry.check(now)
        kept.append(publisher.latched_messages)
    assert kept == [4, 4, 2, 2, 0]
    assert publisher.latched_bytes == 0
    assert heard_late(switch, "/forever") == [0, 1]
    switch.send(talker, stamped(number, 20, 1_100))
    for now in (100, 110, 111):
        routes.latched_expiry.check(now)
        kept.append(publisher.latched_messages)
    assert kept[-3:] == [2, 2, 0]
