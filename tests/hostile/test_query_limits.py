"""WATCH and INSPECT: a link may have a limited number without answers, and links share the answers."""

from __future__ import annotations

import asyncio
import itertools
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import pytest

import actors
from broker import Broker, BrokerOptions
from broker.routing.graph import ENTRIES_PER_FRAME, ENTRIES_PER_REPORT, MAX_UNANSWERED, WatchCount
from broker.routing.router import Router
from broker.serving.stats import Statistics
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.rawclient import link
from tests.broker.switch import ManualSwitch, Switch
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.usefixtures("patience")


def test_watches_of_a_large_graph_are_answered_over_many_turns() -> None:
    """Case 54: a turn answers WATCHes with at most 20,000 entries; each is answered, completely."""
    switch = ManualSwitch()
    peer = switch.join("/n")
    switch.send(peer, *(make.subscription(number, f"/t{number}") for number in range(1, 6001)))
    switch.report()
    switch.read_all(peer)
    watcher = switch.join()
    switch.send(watcher, *(frames.Watch(number, keep=False) for number in range(1, 8)))
    answered: list[list[int]] = []
    while switch.router.graph.asked:
        switch.carry(switch.router.report())
        came = switch.read(watcher, frames.Graph)
        answered.append([frame.watch for frame in came if not frame.more])
        assert sum(len(frame.added) for frame in came) <= ENTRIES_PER_REPORT
        assert all(len(frame.added) <= ENTRIES_PER_FRAME for frame in came)
    assert answered == [[1, 2, 3], [4, 5, 6], [7]]


@pytest.mark.parametrize("kept", [True, False])
def test_watches_that_wait_for_an_answer_are_limited(kept: bool) -> None:
    """Case 54: one WATCH too many ends its link, also if none of them is kept; others get their answers."""
    switch = ManualSwitch()
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
    switch = ManualSwitch()
    peer = switch.join("/n")
    for number in range(2 * MAX_UNANSWERED):
        switch.send(peer, frames.Watch(number, keep=False))
        switch.report()
    assert len(switch.read(peer, frames.Graph)) == 2 * MAX_UNANSWERED


def test_watches_of_all_links_are_limited() -> None:
    """Case 54: a watch beyond the broker's limit is refused by name; ended ones free their places."""
    watches = WatchCount(3)
    switches = [Switch(Router(domain=domain, watches=watches)) for domain in (0, 1)]
    one, two = (switch.join() for switch in switches)
    switches[0].send(one, frames.Watch(1, keep=True), frames.Watch(2, keep=True))
    switches[1].send(two, *(frames.Watch(number, keep=number != 5) for number in (3, 4, 5)))
    (refused,) = switches[1].read(two, frames.Refused)
    assert (refused.id, refused.code) == (4, ErrorCode.LIMIT)
    assert "--max-watches" in refused.text
    assert switches[1].router.refusals.count == 1
    switches[0].send(one, frames.Unwatch(1))
    switches[1].send(two, frames.Watch(6, keep=True))
    assert not switches[1].read(two, frames.Refused)
    assert watches.kept == 3
    switches[0].leave(one)
    switches[1].leave(two)
    assert watches.kept == 0


async def test_a_node_hears_that_its_watch_is_refused() -> None:
    """A wait for the graph fails with the broker's reason instead of lasting for ever."""
    options = BrokerOptions(port=0, max_watches=0, drain_timeout_sec=0.2)
    async with Broker(options) as small, actors.Node("n", url=small.url) as node:
        with pytest.raises(actors.BrokerUnreachable, match="--max-watches"):
            await node.wait_for_node("/nobody")


async def test_statistics_are_collected_once_for_all_links_that_ask() -> None:
    """Case 54: 20 links that ask at the same time get the same snapshot, each under its own id."""
    async with AsyncExitStack() as stack:
        options = BrokerOptions(port=0, drain_timeout_sec=0.2)
        # Nothing takes any time: on a busy machine reading and answering might need more loop turns.
        broker = await stack.enter_async_context(Broker(options, clock=lambda: 0.0))
        clients = [await stack.enter_async_context(link(broker, f"/n{number}")) for number in range(20)]
        for number, client in enumerate(clients):
            client.send(frames.Inspect(1000 + number))
        answers = [await client.next(frames.Stats) for client in clients]
        assert [answer.id for answer in answers] == [1000 + number for number in range(20)]
        assert all(len(answer.links) == 20 or answer.more for answer in answers)
        assert len({answer.totals["stamp_sec"] for answer in answers}) <= 4


async def test_inspects_that_wait_for_an_answer_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 54: where a snapshot takes long, a flood of INSPECTs ends its link; a bystander is answered."""
    set_limits(monkeypatch, unanswered_inspects=50)
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


async def test_an_error_in_one_answer_does_not_keep_others_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error is logged with its traceback, and the next link that waits is answered."""
    errors: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))
    answer = Statistics.answer

    def fail_once(*arguments: Any) -> Iterator[frames.Stats]:
        if not errors:
            raise RuntimeError("once")
        return answer(*arguments)

    monkeypatch.setattr(Statistics, "answer", fail_once)
    async with (
        Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as broker,
        link(broker) as first,
        link(broker, "/second") as second,
    ):
        first.send(frames.Inspect(1))
        second.send(frames.Inspect(2))
        assert (await second.next(frames.Stats)).id == 2
    assert [str(error) for error in errors] == ["once"]
