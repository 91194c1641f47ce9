"""Deliveries for links that cannot send any more."""

from __future__ import annotations

import asyncio

import pytest

from broker.access.admission import Admission
from broker.options import BrokerOptions
from broker.routing.deliveries import Discard
from broker.serving.capacity import Capacity
from broker.serving.dispatcher import Dispatcher
from broker.serving.link import Link
from broker.serving.memory_guard import MUCH_BYTES
from broker.serving.peer_warnings import PeerWarnings
from broker.serving.periodic_check import PeriodicCheck
from broker.serving.presence_log import PresenceLog
from proto.aio.budgeted_channel import BudgetedChannel
from proto.aio.read_budget import ReadBudget
from proto.loop_lag import LoopLag
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import encode
from proto.wire.frames import Undeclare
from proto.wire.session import Role
from tests.system import count_returned_memory


class Silent:
    """A ChannelHandler that does nothing."""

    def __getattr__(self, name: str) -> object:
        return lambda *_: None


async def test_a_link_that_is_closing_counts_nothing_that_is_gone() -> None:
    """A queue discarded between the end of the channel and that of the link leaves no bytes in the outbox."""
    options = BrokerOptions()
    admission = Admission(None, max_per_address=10, plain_tokens=False)
    dispatcher = Dispatcher(
        options, Capacity(10), admission, PresenceLog(10, lambda: 0.0), PeerWarnings(lambda: 0.0)
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    channel.connected = True
    link = Link(channel, options, 0.0)
    dispatcher.join(link, 0, b"instance", b"token")
    assert link.router is not None
    queue = PublisherQueue(1, 10)
    channel.outbox.enqueue(queue, encode(Undeclare(1)))
    assert channel.outbox.undroppable_bytes
    channel.connected = False
    dispatcher.deliver(link.router, [Discard(link.peer, queue)])
    assert queue.empty
    assert not channel.outbox.undroppable_bytes


async def test_a_link_that_was_closed_after_its_handshake_may_read_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The handshake's deadline is not for it, however old it is: unsent bytes are not discarded."""
    options = BrokerOptions()
    admission = Admission(None, max_per_address=10, plain_tokens=False)
    dispatcher = Dispatcher(
        options, Capacity(10), admission, PresenceLog(10, lambda: 0.0), PeerWarnings(lambda: 0.0)
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    aborted: list[bool] = []
    monkeypatch.setattr(BudgetedChannel, "abort", lambda _: aborted.append(True))
    link = Link(channel, options, 0.0)
    link.session = 1
    dispatcher.join(link, 0, b"instance", b"token")
    dispatcher.leave(link)
    PeriodicCheck(dispatcher, LoopLag()).check_link(link, 3600.0, all_due=True)
    assert not aborted


async def test_a_link_whose_bytes_wait_for_their_turn_is_alive(monkeypatch: pytest.MonkeyPatch) -> None:
    """A peer that sends more than its share is not taken for silent, however long it waits for the loop."""
    options = BrokerOptions()
    admission = Admission(None, max_per_address=10, plain_tokens=False)
    dispatcher = Dispatcher(
        options, Capacity(10), admission, PresenceLog(10, lambda: 0.0), PeerWarnings(lambda: 0.0)
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    monkeypatch.setattr(BudgetedChannel, "waiting", True)
    link = Link(channel, options, 0.0)
    dispatcher.join(link, 0, b"instance", b"token")
    PeriodicCheck(dispatcher, LoopLag()).check_link(link, 3600.0, all_due=True)
    assert link.suspended_at is None
    assert link.liveness.last_seen_at == 3600.0


@pytest.mark.parametrize(("held", "times"), [(MUCH_BYTES, 1), (1000, 0)])
async def test_memory_is_returned_after_a_link_that_held_much(
    monkeypatch: pytest.MonkeyPatch, held: int, times: int
) -> None:
    """Case 46: the end of a link with 16 MiB lets the periodic check return free memory, once."""
    returned = count_returned_memory(monkeypatch)
    options = BrokerOptions()
    admission = Admission(None, max_per_address=10, plain_tokens=False)
    dispatcher = Dispatcher(
        options, Capacity(10), admission, PresenceLog(10, lambda: 0.0), PeerWarnings(lambda: 0.0)
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    link = Link(channel, options, 0.0)
    dispatcher.join(link, 0, b"instance", b"token")
    channel.outbox.put_control(bytes(held))
    dispatcher.leave(link)
    check = PeriodicCheck(dispatcher, LoopLag())
    for second in range(3):
        check.return_memory(100.0 + second)
    assert len(returned) == times


async def test_a_late_rejection_is_sent_once() -> None:
    """Case 32: a peer that does not read its refusal gets it once, however often it is checked."""
    options = BrokerOptions()
    admission = Admission(None, max_per_address=10, plain_tokens=False)
    dispatcher = Dispatcher(
        options, Capacity(10), admission, PresenceLog(10, lambda: 0.0), PeerWarnings(lambda: 0.0)
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    channel.connected = True
    link = Link(channel, options, 0.0)
    link.rejected = "it has no valid token"
    check = PeriodicCheck(dispatcher, LoopLag())
    check.check_link(link, 2.0, all_due=True)
    sent = channel.outbox.urgent_bytes
    for second in (2.5, 3.0, 4.0):
        check.check_link(link, second, all_due=True)
    assert channel.outbox.urgent_bytes == sent > 0
