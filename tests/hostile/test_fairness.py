"""Floods: one connection cannot take the broker's loop, and a broker that is flooded still stops in time."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from broker.access.admission import Admission
from broker.serving.capacity import Capacity
from broker.serving.dispatcher import Dispatcher
from broker.serving.link import Link
from broker.serving.peer_warnings import PeerWarnings
from broker.serving.periodic_check import PeriodicCheck
from broker.serving.presence_log import PresenceLog
from proto.aio.budgeted_channel import BudgetedChannel
from proto.aio.read_budget import ReadBudget
from proto.loop_lag import LoopLag
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.session import Role
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, link, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

DRAIN_SEC = 0.2


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=DRAIN_SEC)) as running:
        yield running


def flood(client: RawClient, frame: frames.Frame, count: int) -> None:
    """Send many frames at once."""
    client.channel.outbox.put_calls(encode(frame) * count)
    client.channel.flush()


async def test_others_are_served_between_the_shares_of_a_flood(broker: Broker) -> None:
    """Case 54: while a burst of 20,000 PINGs is handled, a bystander's is answered after a few shares."""
    async with link(broker, "/flooder") as flooder, link(broker, "/bystander") as bystander:
        flood(flooder, frames.Ping(1), 20_000)
        answered = 0
        for _ in range(5):
            await bystander.synchronise()
            answered += len(flooder.waiting(frames.Pong))
            assert answered < 20_000 // 2
        assert answered  # at least a share of the flood, which is smaller on a slow machine
        while answered < 20_000:
            await flooder.next(frames.Pong)
            answered += 1 + len(flooder.waiting(frames.Pong))
        assert answered == 20_000


async def test_a_flooded_broker_stops_in_time(broker: Broker) -> None:
    """Case 54: with links that never stop to send, a stop ends within the limit of its drain."""
    async with AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(link(broker, f"/flooder{n}")) for n in range(4)]
        for number, client in enumerate(clients):
            client.send(make.publisher(1, f"/t{number}"), make.subscription(2, raw=True))
            await client.synchronise()

        async def go_on(client: RawClient) -> None:
            while client.channel.connected:
                flood(client, frames.Describe(make.HASH), 5000)
                await asyncio.sleep(0)
                client.waiting(frames.Definition)

        floods = [asyncio.create_task(go_on(client)) for client in clients]
        await until(lambda: broker.stats().bytes_received > 1_000_000)
        loop = asyncio.get_running_loop()
        began = loop.time()
        await broker.stop()
        assert loop.time() - began < DRAIN_SEC + 10
        await asyncio.gather(*floods)


class Silent:
    """A ChannelHandler that does nothing."""

    def __getattr__(self, name: str) -> object:
        return lambda *_: None


@pytest.mark.parametrize("waiting", [True, False])
async def test_a_link_whose_bytes_wait_is_not_silent(waiting: bool) -> None:
    """Received bytes that wait for the read budget are a sign of life: such a link is not suspended."""
    options = BrokerOptions()
    dispatcher = Dispatcher(
        options,
        Capacity(10),
        Admission(None, max_per_address=10, plain_tokens=False),
        PresenceLog(10, lambda: 0.0),
        PeerWarnings(lambda: 0.0),
    )
    loop = asyncio.get_running_loop()
    channel = BudgetedChannel(Role.BROKER, Silent(), loop=loop, budget=ReadBudget(loop))  # type: ignore[arg-type]
    channel.connected = True
    channel.waiting = waiting
    link = Link(channel, options, 0.0)
    dispatcher.join(link, 0, b"instance", b"token")
    check = PeriodicCheck(dispatcher, LoopLag())
    for second in range(60):
        check.check_link(link, float(second), all_due=True)
    assert (link.suspended_at is None) == waiting
