"""Queues without a publisher or a reader are forgotten when they are empty, and their counts are kept."""

from __future__ import annotations

import pytest

from broker.routing.departed_queues import FORGET_QUEUES
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

ROUNDS = FORGET_QUEUES + FORGET_QUEUES // 2


def come_and_go(switch: Switch, who: str, *, read: bool) -> None:
    """Let a reader, or a publisher, of one message come and go many times on links that stay."""
    talker, listener = switch.join("/talker"), switch.join("/listener")
    lasting, passing = (talker, listener) if who == "reader" else (listener, talker)
    if who == "publisher":
        switch.send(lasting, make.subscription(1))
        number = 0
    else:
        number = switch.publisher(lasting, make.publisher(1))
    for count in range(ROUNDS):
        if who == "reader":
            switch.send(passing, make.subscription(1))
        else:
            declared = make.publisher(1)._replace(gid=count.to_bytes(16, "big"))
            number = switch.publisher(passing, declared)
        switch.send(talker, make.batch(number, count))
        if read:
            assert len(switch.read(listener, frames.Batch)) == 1
        switch.send(passing, frames.Undeclare(1))
        if read:
            switch.read_all(talker)
            switch.read_all(listener)


@pytest.mark.parametrize("who", ["reader", "publisher"])
def test_empty_queues_are_forgotten_and_their_messages_stay_counted(who: str) -> None:
    """However many come and go, about FORGET_QUEUES queues are kept; sums count each message as delivered."""
    switch = Switch()
    come_and_go(switch, who, read=True)
    routes = switch.router.routes
    assert len(routes.peer_queues()) <= FORGET_QUEUES + 2
    total, by_topic = routes.tallies()
    assert total.delivered == routes.copies == ROUNDS
    (topic,) = switch.router.topics.by_name.values()
    assert by_topic.get(topic, topic.forgotten).delivered == ROUNDS


def test_queues_that_are_emptied_after_their_publisher_left_are_forgotten() -> None:
    """A publisher of one message is gone before anybody reads, again and again."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1))
    for count in range(ROUNDS):
        declared = make.publisher(1)._replace(gid=count.to_bytes(16, "big"))
        switch.send(talker, make.batch(switch.publisher(talker, declared), count), frames.Undeclare(1))
        assert len(switch.read(listener, frames.Batch)) == 1
    assert len(switch.router.routes.peer_queues()) <= FORGET_QUEUES + 2
    assert switch.router.routes.tallies()[0].delivered == ROUNDS


def test_queues_with_messages_are_not_forgotten() -> None:
    """All messages of publishers that are gone are still delivered."""
    switch = Switch()
    come_and_go(switch, "publisher", read=False)
    routes = switch.router.routes
    assert len(routes.peer_queues()) == ROUNDS
    assert routes.tallies()[0].queued == ROUNDS
    assert len(switch.read(2, frames.Batch)) == ROUNDS
    assert routes.tallies()[0].delivered == ROUNDS


def test_the_oldest_queue_loses_its_messages() -> None:
    """A publisher that has been back since is not the oldest, although it left an (empty) queue before."""
    switch = Switch(Router(limits=RouterLimits(max_departed_queues=2)))
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1))
    for sequence, who in enumerate("abac"):
        declared = make.publisher(1)._replace(gid=who.encode().ljust(16))
        number = switch.publisher(talker, declared)
        switch.send(talker, make.batch(number, sequence), frames.Undeclare(1))
        if not sequence:
            switch.read_all(reader)
    assert [batch.first_sequence for batch in switch.read(reader, frames.Batch)] == [2, 3]
