"""Limits of what declarations cost: a link has a limited number of matches."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from broker import Broker, BrokerOptions
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.errors import ErrorCode
from proto.limited_log import MAX_LINES
from proto.wire import frames
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.rawclient import link
from tests.broker.switch import Switch

if TYPE_CHECKING:
    import pytest


def test_matches_are_refused_before_they_cost_anything() -> None:
    """Case 43: of 100 publishers to 100 raw subscriptions on one link, the limit of 2,000 lets 10 match."""
    switch = Switch(Router(limits=RouterLimits(max_matches=2000)))
    peer = switch.join("/n")
    switch.send(peer, *(make.subscription(number, raw=True) for number in range(1, 101)))
    switch.read_all(peer)
    switch.send(peer, *(make.publisher(number) for number in range(101, 201)))
    came = switch.read_all(peer)
    refused = [frame for frame in came if isinstance(frame, frames.Refused)]
    assert [frame.id for frame in refused] == list(range(111, 201))
    assert {frame.code for frame in refused} == {ErrorCode.LIMIT}
    assert all("--max-matches" in frame.text for frame in refused)
    record = switch.router.peer(peer)
    assert record is not None
    assert record.matches == 2000
    assert switch.router.refusals.count == 90
    assert len([frame for frame in came if isinstance(frame, frames.Attached)]) == 10
    switch.send(peer, frames.Undeclare(101), make.publisher(201), make.publisher(202))
    assert [frame.id for frame in switch.read(peer, frames.Accepted)] == [201]
    switch.leave(peer)
    assert record.matches == 0


def test_only_the_link_that_declares_is_limited() -> None:
    """Another link may add a reader to a link that has used its matches, and other types are free."""
    switch = Switch(Router(limits=RouterLimits(max_matches=10)))
    guilty, innocent = switch.join("/guilty"), switch.join("/innocent")
    switch.send(guilty, *(make.subscription(number) for number in range(1, 6)), make.publisher(6))
    assert not switch.read(guilty, frames.Refused)
    switch.send(innocent, make.subscription(1))
    assert [frame.id for frame in switch.read(innocent, frames.Accepted)] == [1]
    switch.send(
        guilty, make.publisher(7), make.publisher(8, type_hash="RIHS01_bb"), make.publisher(9, "/other")
    )
    assert [frame.id for frame in switch.read(guilty, frames.Refused)] == [7]


def test_services_are_limited_like_topics() -> None:
    """Case 43: clients and servers of one service are pairs, too."""
    switch = Switch(Router(limits=RouterLimits(max_matches=8)))
    peer = switch.join("/n")
    switch.send(peer, make.service(1), make.service(2), *(make.client(number) for number in range(3, 8)))
    assert [frame.id for frame in switch.read(peer, frames.Refused)] == [5, 6, 7]
    other = switch.join("/other")
    switch.send(other, make.client(1), make.service(2))
    assert not switch.read(other, frames.Refused)


def test_a_link_that_returns_to_too_many_counterparts_is_closed() -> None:
    """Case 43: what was declared while a link was suspended does not multiply when it comes back."""
    switch = Switch(Router(limits=RouterLimits(max_matches=100)))
    sleeper, other = switch.join("/sleeper"), switch.join("/other")
    switch.send(sleeper, *(make.subscription(number) for number in range(1, 21)))
    switch.suspend(sleeper)
    switch.send(other, *(make.publisher(number) for number in range(1, 21)))
    switch.read_all(other)
    switch.restore(sleeper)
    assert switch.closed == {sleeper: ErrorCode.LIMIT}
    matched = switch.read(other, frames.Matched)
    assert max((frame.peers for frame in matched), default=0) <= 5
    switch.send(other, frames.Undeclare(1))
    assert switch.router.peer(sleeper) is None


def test_a_refused_publisher_leaves_no_definition() -> None:
    """A declaration beyond the limit of matches takes nothing of the limits of definitions."""
    switch = Switch(Router(limits=RouterLimits(max_matches=1)))
    peer = switch.join("/n")
    publisher = make.publisher(2, type_hash=hash_of(b"type"))._replace(definition=b"type")
    switch.send(peer, make.subscription(1, raw=True), publisher)
    assert [frame.id for frame in switch.read(peer, frames.Refused)] == [2]
    assert len(switch.router.declarations.definitions) == 0


async def test_a_burst_of_publishers_does_not_hold_up_others() -> None:
    """Case 43: 1,000 subscriptions, then 1,500 PUBLISHERs in one write; a bystander is served in between."""
    options = BrokerOptions(port=0, max_matches=40_000, drain_timeout_sec=0.2)
    async with (
        Broker(options) as small,
        link(small, "/guilty") as guilty,
        link(small, "/bystander") as bystander,
    ):
        guilty.send(*(make.subscription(number, raw=True) for number in range(1, 1001)))
        await guilty.synchronise()
        guilty.send(*(make.publisher(number) for number in range(1001, 2501)))
        answered = rounds = 0
        while answered < 1500:
            await bystander.synchronise()
            came = guilty.waiting(object)
            answered += sum(isinstance(frame, frames.Accepted | frames.Refused) for frame in came)
            rounds += 1
        assert rounds > 3
        assert small.stats().refused_declarations == 1480


async def test_refusals_are_few_lines_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    """However much a limit refuses: ten lines, which name the link and the option, and a sum."""
    options = BrokerOptions(port=0, max_matches=1, max_watches=1, drain_timeout_sec=0.2)
    with caplog.at_level(logging.WARNING, "callboard.broker"):
        async with Broker(options) as small, link(small, "/guilty") as guilty:
            guilty.send(make.subscription(1), *(make.publisher(number) for number in range(2, 10)))
            guilty.send(*(frames.Watch(number, keep=True) for number in range(10, 103)))
            await guilty.synchronise()
            assert small.stats().refused_declarations == 100
    *lines, total = caplog.text.splitlines()  # formatted while the link had its node
    assert len(lines) == MAX_LINES
    assert all("/guilty" in line for line in lines)
    assert ["--max-matches" in line for line in lines] == [True] * 8 + [False] * 2
    assert "--max-watches" in lines[-1]
    assert total.endswith("… and 90 more like this: refused declarations and watches")
