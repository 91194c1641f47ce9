"""Processes on a failing network: connections cut in one direction, slow ones, and resets."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.testing import Direction, FaultProxy
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE, wait_for_subscriptions
from tests.integration.counter import COUNTER, Counted

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.integration.conftest import Program, System

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)


class RemoteCounter:
    """A counter behind a proxy, and a node that publishes to it and calls it."""

    def __init__(self, proxy: FaultProxy, counter: Program, node: actors.Node) -> None:
        self.proxy = proxy
        self.counter = counter
        self.node = node
        self.publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        self.client = node.create_client(AddTwoInts, "block")

    async def wait_until_found(self) -> None:
        """Wait until the counter is matched."""
        assert await self.client.wait_for_service(DEADLINE_SEC)
        await wait_for_subscriptions(self.publisher)

    async def wait_until_lost(self) -> None:
        """Wait until the counter has left the graph."""
        async with asyncio.timeout(DEADLINE_SEC):
            while self.client.service_is_ready() or self.publisher.get_subscription_count():
                await self.node.get_graph()

    def publish(self, count: int) -> None:
        """Publish the next numbers."""
        for number in range(self.publisher.published, self.publisher.published + count):
            self.publisher.publish(Int64(data=number))

    async def counted(self) -> Counted:
        """Publish the last number; return the counters of the subscription."""
        await self.wait_until_found()
        self.publisher.publish(Int64(data=-self.publisher.published))
        return Counted.read(await self.counter.wait_for_line("counted"))


@pytest.fixture
async def far(system: System, request: pytest.FixtureRequest) -> AsyncIterator[RemoteCounter]:
    """A counter and a broker (the parameter is its options; by default none), each a process."""
    await system.broker(*getattr(request, "param", ()))
    near = system.url
    async with FaultProxy(near) as proxy, actors.Node("talker", url=near) as node:
        system.url = proxy.url
        counter = await system.python("-c", COUNTER)
        place = RemoteCounter(proxy, counter, node)
        await place.wait_until_found()
        yield place


@pytest.mark.parametrize("direction", list(Direction), ids=lambda each: each.name)
async def test_a_cut_in_one_direction_is_noticed_and_the_counts_add_up(
    far: RemoteCounter, direction: Direction
) -> None:
    """Case 40: the call fails, the publisher continues, and after the repair every message is counted."""
    far.publish(99)
    assert (await far.counted()).received == 100  # a reply does not prove it, as calls overtake messages
    far.proxy.black_hole(direction=direction)
    far.publish(100)
    with pytest.raises(actors.ServiceUnavailable):
        await far.client.call(AddTwoInts.Request(a=1), timeout_sec=1000)
    await far.wait_until_lost()
    far.publish(100)
    await far.publisher.flush(timeout_sec=DEADLINE_SEC)
    far.proxy.heal()
    counted = await far.counted()
    assert sum(counted) == far.publisher.published == 301
    assert counted.received >= 100
    assert (await far.client.call(AddTwoInts.Request(a=2))).sum == 2


async def test_a_late_reply_does_not_answer_another_call(far: RemoteCounter) -> None:
    """Case 38: the late reply of a disconnected server is dropped; the next call gets its own reply."""
    far.proxy.black_hole(direction=Direction.TO_BROKER)  # the call arrives, its reply does not
    call = far.client.call_async(AddTwoInts.Request(a=7), timeout_sec=1000)
    await far.counter.wait_for_line("blocking")
    with pytest.raises(actors.ServiceUnavailable):
        await call
    far.proxy.heal()
    await far.wait_until_found()
    for number in range(1, 20):
        assert (await far.client.call(AddTwoInts.Request(a=number % 3))).sum == number % 3


@pytest.mark.parametrize("far", [NO_KEEPALIVE], indirect=True)
async def test_resets_repeat_no_message_and_hide_no_loss(far: RemoteCounter) -> None:
    """After five resets under load order holds, all calls have ended, and the counts add up."""
    for _ in range(5):
        await far.wait_until_found()
        assert (await far.client.call(AddTwoInts.Request(a=0))).sum == 0
        # The last takes long, so that it has no answer yet on a busy machine either.
        blocks_ms = [1] * 199 + [500]
        calls = [far.client.call_async(AddTwoInts.Request(a=each), timeout_sec=1000) for each in blocks_ms]
        far.publish(2000)
        await far.counter.wait_for_line("blocking")
        far.proxy.reset()
        ends = await asyncio.gather(*calls, return_exceptions=True)
        assert {type(end) for end in ends} <= {AddTwoInts.Response, actors.ServiceUnavailable}
        assert isinstance(ends[-1], actors.ServiceUnavailable)
        await far.wait_until_lost()
    counted = await far.counted()
    assert sum(counted) == far.publisher.published == 10_001
    assert counted.lost == 0
    assert far.proxy.resets == 5
    assert far.client.pending == 0


@pytest.mark.parametrize("far", [NO_KEEPALIVE], indirect=True)
async def test_a_slow_connection_delays_and_loses_nothing(far: RemoteCounter) -> None:
    """Case 40: in pieces of 100 bytes all messages and replies arrive, over one connection."""
    far.proxy.drip(100, every_sec=0.001)
    far.publish(1000)
    calls = [far.client.call_async(AddTwoInts.Request(a=0)) for _ in range(50)]
    assert [response.sum for response in await asyncio.gather(*calls)] == [0] * 50
    assert await far.counted() == (1001, 0, 0)
    assert far.proxy.accepted == 1
