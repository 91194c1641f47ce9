"""Answers that cost more than their question are combined: once for each link and loop turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from proto.wire import frames
from proto.wire.codec import decode, encode, encode_graph, encode_graph_changes, encode_graph_entry
from tests.broker import frame_makers as make
from tests.broker.rawclient import link
from tests.broker.switch import ManualSwitch

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


def test_matched_comes_once_for_each_endpoint_and_turn() -> None:
    """Case 43: 30 subscriptions and 20 publishers cause 50 MATCHED, not 600, and 20 ATTACHED."""
    switch = ManualSwitch()
    peer = switch.join("/n")
    switch.send(peer, *(make.subscription(number, raw=True) for number in range(1, 31)))
    switch.send(peer, *(make.publisher(number) for number in range(31, 51)))
    switch.report()
    came = switch.read_all(peer)
    matched = {frame.id: frame for frame in came if isinstance(frame, frames.Matched)}
    assert len([frame for frame in came if isinstance(frame, frames.Matched)]) == 50
    assert all(matched[number].peers == 20 for number in range(1, 31))
    assert all(matched[number].peers == 30 for number in range(31, 51))
    attached = [frame for frame in came if isinstance(frame, frames.Attached)]
    assert [len(frame.subscriptions) for frame in attached] == [30] * 20


def test_declared_and_undeclared_in_one_turn_costs_its_counterparts_nothing() -> None:
    """Case 54: MATCHED reports numbers, so those that change back within a turn are sent once at most."""
    switch = ManualSwitch()
    one, other = switch.join("/one"), switch.join("/other")
    switch.send(other, make.publisher(1))
    switch.report()
    switch.read_all(other)
    for number in range(1, 101):
        switch.send(one, make.subscription(number), frames.Undeclare(number))
    switch.report()
    assert switch.read(other, frames.Matched) == [frames.Matched(1, 0, 100)]
    assert not switch.read(one, frames.Matched)


def test_attached_precedes_the_first_batch_of_a_turn() -> None:
    """§6.3.2: a batch that follows the declaration in the same turn finds its reader attached."""
    switch = ManualSwitch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(listener, make.subscription(1))
    switch.send(talker, make.batch(number, 0))
    switch.report()
    kinds = [type(frame) for frame in switch.read_all(listener)]
    assert kinds.index(frames.Attached) < kinds.index(frames.Batch)


def test_attached_does_not_follow_an_undeclare() -> None:
    """A subscription that goes in the turn in which it came leaves nothing in a queue that nobody reads."""
    switch = ManualSwitch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(listener, make.subscription(1), frames.Undeclare(1))
    switch.send(talker, make.batch(number, 0))
    switch.report()
    assert not switch.read(listener, frames.Attached)
    assert not switch.read(listener, frames.Batch)


def test_an_assert_is_forwarded_once_a_turn() -> None:
    """Case 54: a thousand ASSERTs of a publisher cost each of its readers one frame."""
    switch = ManualSwitch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1))
    number = switch.publisher(talker, make.publisher(1))
    switch.read_all(listener)
    switch.send(talker, *[frames.Assert(number)] * 1000)
    switch.report()
    assert switch.read(listener, frames.Assert) == [frames.Assert(number)]
    switch.send(talker, frames.Assert(number), frames.Undeclare(1))
    switch.report()
    assert not switch.read(listener, frames.Assert)


def test_a_change_reaches_each_watch_once_a_turn() -> None:
    """Case 54: declarations of one turn come in one GRAPH frame to each of many watches."""
    switch = ManualSwitch()
    watchers = [switch.join() for _ in range(5)]
    for watcher in watchers:
        switch.send(watcher, *(frames.Watch(number, keep=True) for number in range(1, 11)))
    switch.report()
    for watcher in watchers:
        switch.read_all(watcher)
    guilty = switch.join("/guilty")
    switch.send(guilty, *(make.subscription(number) for number in range(1, 50)))
    switch.report()
    for watcher in watchers:
        changes = switch.read(watcher, frames.Graph)
        assert sorted(change.watch for change in changes) == list(range(1, 11))
        assert {len(change.added) for change in changes} == {50}


def test_a_watch_that_ends_before_its_answer_gets_no_changes() -> None:
    """UNWATCH in the same turn: one answer comes, and nothing afterwards."""
    switch = ManualSwitch()
    watcher = switch.join()
    switch.send(watcher, frames.Watch(1, keep=True), frames.Unwatch(1))
    switch.report()
    assert len(switch.read(watcher, frames.Graph)) == 1
    switch.join("/later")
    switch.report()
    assert not switch.read(watcher, frames.Graph)
    assert not switch.router.graph.watched


def test_a_graph_frame_in_parts_is_the_same_frame() -> None:
    """What is encoded once for all watches decodes like a frame encoded as a whole."""
    entries = tuple(frames.GraphEntry(n, 1, "/n", f"/t{n}", "x/msg/Y", "h", {"depth": n}) for n in range(30))
    for added, removed in ((entries, ()), ((), (5, 2**40)), ((), ())):
        changes = encode_graph_changes([encode_graph_entry(entry) for entry in added], removed, removed[:1])
        for watch, more in ((0, True), (70_000, False)):
            frame = frames.Graph(watch, more, added, removed, removed[:1])
            raw = encode_graph(watch, more=more, changes=changes)
            assert decode(raw) == frame == decode(encode(frame))


async def test_a_pong_follows_what_the_frames_before_its_ping_have_caused(broker: Broker) -> None:
    """§4.3.2: reports wait for the end of the loop turn, and the PONG waits for them."""
    async with link(broker, "/a") as a:
        a.send(make.subscription(1), make.publisher(2), frames.Watch(9, keep=False), frames.Ping(3))
        kinds: list[type] = []
        while frames.Pong not in kinds:
            kinds.append(type(await a.next(object)))
        assert kinds[-1] is frames.Pong
        assert kinds.count(frames.Matched) == 2
        assert kinds.count(frames.Graph) == 1
