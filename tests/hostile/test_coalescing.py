"""Answers that cost more than their question are combined: once for each link and loop turn."""

from __future__ import annotations

import itertools
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from broker.graph import ENTRIES_PER_FRAME, ENTRIES_PER_REPORT, MAX_UNANSWERED
from proto import frames
from proto.codec import decode, encode, encode_graph, encode_graph_changes, encode_graph_entry
from proto.errors import ErrorCode, ProtocolError
from tests.broker import frame_makers as make
from tests.broker.rawclient import link
from tests.broker.switch import Switch

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


class Turn(Switch):
    """A switch whose router reports only when the test says that a loop turn ends."""

    def send(self, peer: int, *sent: frames.Frame) -> None:
        """Let a peer send frames in one loop turn."""
        for frame in sent:
            self._carry(self.router.handle(peer, frame))

    def publisher(self, peer: int, declaration: frames.Publisher) -> int:
        """Declare a publisher; return its broker-wide id."""
        number = super().publisher(peer, declaration)
        self.report()
        return number


def test_matched_comes_once_for_each_endpoint_and_turn() -> None:
    """Case 43: 30 subscriptions and 20 publishers cause 50 MATCHED, not 600, and 20 ATTACHED."""
    switch = Turn()
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
    switch = Turn()
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
    switch = Turn()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(listener, make.subscription(1))
    switch.send(talker, make.batch(number, 0))
    switch.report()
    kinds = [type(frame) for frame in switch.read_all(listener)]
    assert kinds.index(frames.Attached) < kinds.index(frames.Batch)


def test_attached_does_not_follow_an_undeclare() -> None:
    """A subscription that goes in the turn in which it came leaves nothing in a queue that nobody reads."""
    switch = Turn()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(listener, make.subscription(1), frames.Undeclare(1))
    switch.send(talker, make.batch(number, 0))
    switch.report()
    assert not switch.read(listener, frames.Attached)
    assert not switch.read(listener, frames.Batch)


def test_an_assert_is_forwarded_once_a_turn() -> None:
    """Case 54: a thousand ASSERTs of a publisher cost each of its readers one frame."""
    switch = Turn()
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
    switch = Turn()
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


def test_watches_of_a_large_graph_are_answered_over_many_turns() -> None:
    """Case 54: a turn answers WATCHes with at most 20,000 entries; each is answered, completely."""
    switch = Turn()
    peer = switch.join("/n")
    switch.send(peer, *(make.subscription(number, f"/t{number}") for number in range(1, 6001)))
    switch.report()
    switch.read_all(peer)
    watcher = switch.join()
    switch.send(watcher, *(frames.Watch(number, keep=False) for number in range(1, 8)))
    answered: list[list[int]] = []
    while switch.router.graph.asked:
        switch._carry(switch.router.report())
        came = switch.read(watcher, frames.Graph)
        answered.append([frame.watch for frame in came if not frame.more])
        assert sum(len(frame.added) for frame in came) <= ENTRIES_PER_REPORT
        assert all(len(frame.added) <= ENTRIES_PER_FRAME for frame in came)
    assert answered == [[1, 2, 3], [4, 5, 6], [7]]


@pytest.mark.parametrize("kept", [True, False])
def test_watches_that_wait_for_an_answer_are_limited(kept: bool) -> None:
    """Case 54: one WATCH too many ends its link, also if none of them is kept; others get their answers."""
    switch = Turn()
    guilty, bystander = switch.join("/guilty"), switch.join("/bystander")
    for number in range(MAX_UNANSWERED):
        switch.send(guilty, frames.Watch(number, keep=kept))
        if kept:
            switch.send(guilty, frames.Unwatch(number))
    switch.send(bystander, frames.Watch(1, keep=False))
    with pytest.raises(ProtocolError) as caught:
        switch.send(guilty, frames.Watch(MAX_UNANSWERED, keep=False))
    assert caught.value.code is ErrorCode.LIMIT
    assert switch.router.refusals.count == 1
    switch.report()
    assert len(switch.read(bystander, frames.Graph)) == 1


def test_the_limit_of_waiting_watches_counts_only_those_without_an_answer() -> None:
    """A link may ask as often as it likes if it waits for the answers."""
    switch = Turn()
    peer = switch.join("/n")
    for number in range(2 * MAX_UNANSWERED):
        switch.send(peer, frames.Watch(number, keep=False))
        switch.report()
    assert len(switch.read(peer, frames.Graph)) == 2 * MAX_UNANSWERED


def test_a_watch_that_ends_before_its_answer_gets_no_changes() -> None:
    """UNWATCH in the same turn: one answer comes, and nothing afterwards."""
    switch = Turn()
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


async def test_statistics_are_collected_once_for_all_links_that_ask(broker: Broker) -> None:
    """Case 54: 20 links that ask at the same time get the same snapshot, each under its own id."""
    async with AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(link(broker, f"/n{number}")) for number in range(20)]
        for number, client in enumerate(clients):
            client.send(frames.Inspect(1000 + number))
        answers = [await client.next(frames.Stats) for client in clients]
        assert [answer.id for answer in answers] == [1000 + number for number in range(20)]
        assert all(len(answer.links) == 20 or answer.more for answer in answers)
        assert len({answer.totals["stamp_sec"] for answer in answers}) <= 4


async def test_inspects_that_wait_for_an_answer_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 54: where a snapshot takes long, a flood of INSPECTs ends its link; a bystander is answered."""
    monkeypatch.setattr("broker.inspections.MAX_UNANSWERED", 50)
    ticks = itertools.count()
    options = BrokerOptions(port=0, drain_timeout_sec=0.2)
    async with (
        Broker(options, clock=lambda: next(ticks) * 0.01) as broker,
        link(broker, "/guilty") as guilty,
        link(broker, "/bystander") as bystander,
    ):
        guilty.send(*(frames.Inspect(number) for number in range(300)))
        assert (await guilty.next(frames.Error)).code == ErrorCode.LIMIT
        bystander.send(frames.Inspect(1))
        totals = (await bystander.next(frames.Stats)).totals
        assert totals["refused_declarations"] == 1


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
