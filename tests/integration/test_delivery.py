"""Promises about topics, through a real broker: order, latching, back pressure, and counted losses."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import Int64, String
from tests.integration.conftest import DEADLINE_SEC, wait_for_subscriptions

if TYPE_CHECKING:
    import pytest

    import broker
    from tests.integration.conftest import System

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
LATCHED = actors.QoSProfile(depth=3, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)

COUNTING_SUBSCRIBER = """
import actors
from actors.interfaces.std_msgs.msg import Int64

class Counter(actors.Node):
    def __init__(self):
        super().__init__("counter")
        self.heard = []
        self.subscription = self.create_subscription(
            Int64, "numbers", self.on_number, actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
        )

    def on_number(self, msg):
        self.heard.append(msg.data)
        if len(self.heard) == 2000:
            print("in order:", self.heard == list(range(2000)), flush=True)

actors.run(Counter)
"""


async def test_keep_all_loses_nothing(system: System) -> None:
    """Two thousand messages to another process all arrive in order."""
    await system.broker()
    counter = await system.python("-c", COUNTING_SUBSCRIBER)
    async with actors.Node("talker", url=system.url) as node:
        publisher = node.create_publisher(Int64, "numbers", KEEP_ALL)
        await wait_for_subscriptions(publisher)
        for i in range(2000):
            publisher.publish(Int64(data=i))
        assert await counter.wait_for_line("in order") == "in order: True"
        assert publisher.dropped == 0


async def test_keep_all_waits_for_a_slow_reader(hub: broker.Broker) -> None:
    """With more messages than credit all arrive, because `ready()` paces the publisher."""
    total = 100_000
    async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
        publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
        subscription = hearer.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL)
        await wait_for_subscriptions(publisher)

        async def publish() -> None:
            for i in range(total):
                if i % 1000 == 0:
                    await publisher.ready()
                publisher.publish(Int64(data=i))

        publishing = asyncio.create_task(publish())
        expected = 0
        async for msg in subscription:
            assert msg.data == expected
            expected += 1
            if expected % 1000 == 0:
                await asyncio.sleep(0)
            if expected == total:
                break
        await publishing
        assert publisher.dropped == subscription.dropped == subscription.lost == 0


async def test_keep_last_loses_only_the_oldest_and_counts_them(hub: broker.Broker) -> None:
    """A busy reader keeps the newest messages; received and dropped ones add up."""
    total, depth = 5000, 10
    async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
        received: list[int] = []
        busy, go_on = asyncio.Event(), asyncio.Event()

        async def on_number(msg: Int64) -> None:
            received.append(msg.data)
            if msg.data == 0:
                busy.set()
                await go_on.wait()

        publisher = talker.create_publisher(Int64, "numbers", depth)
        subscription = hearer.create_subscription(Int64, "numbers", on_number, depth)
        await wait_for_subscriptions(publisher)
        publisher.publish(Int64(data=0))
        await busy.wait()
        for i in range(1, total):
            publisher.publish(Int64(data=i))
            if i % 100 == 0:
                await publisher.flush()
        await publisher.flush()
        await hearer.get_graph()
        go_on.set()
        last = talker.create_publisher(Int64, "last", depth)
        done = aiter(hearer.create_subscription(Int64, "last", qos_profile=depth))
        await wait_for_subscriptions(last)
        last.publish(Int64(data=0))
        await anext(done)
        async with asyncio.timeout(DEADLINE_SEC):
            while received[-1] != total - 1:
                await hearer.get_graph()
        assert received == [0, *range(total - depth, total)]
        assert subscription.received == len(received)
        assert subscription.received + subscription.dropped + subscription.lost == total
        assert publisher.published == total


async def test_late_joiners_get_the_latched_values(hub: broker.Broker) -> None:
    """They get the last `depth` messages once, in order, then live ones; VOLATILE ones only live ones."""
    async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
        publisher = talker.create_publisher(Int64, "numbers", LATCHED)
        for i in range(5):
            publisher.publish(Int64(data=i))
        await publisher.flush()
        late = aiter(hearer.create_subscription(Int64, "numbers", qos_profile=LATCHED))
        volatile = aiter(hearer.create_subscription(Int64, "numbers", qos_profile=10))
        await wait_for_subscriptions(publisher, 2)
        publisher.publish(Int64(data=5))
        assert [(await anext(late)).data for _ in range(4)] == [2, 3, 4, 5]
        assert (await anext(volatile)).data == 5


async def test_latched_values_disappear_with_their_publisher(hub: broker.Broker) -> None:
    """A subscription made after the publisher has left gets nothing."""
    async with actors.Node("hearer", url=hub.url) as hearer:
        async with actors.Node("talker", url=hub.url) as talker:
            talker.create_publisher(Int64, "numbers", LATCHED).publish(Int64(data=1))
        subscription = hearer.create_subscription(Int64, "numbers", qos_profile=LATCHED)
        await hearer.get_graph()
        assert subscription.queued == 0
        assert subscription.get_publisher_count() == 0


async def test_a_stopping_publisher_sends_its_queue(hub: broker.Broker) -> None:
    """Leaving `async with` right after publishing loses nothing."""
    async with actors.Node("hearer", url=hub.url) as hearer:
        received = aiter(hearer.create_subscription(Int64, "numbers", qos_profile=KEEP_ALL))
        async with actors.Node("talker", url=hub.url) as talker:
            publisher = talker.create_publisher(Int64, "numbers", KEEP_ALL)
            await wait_for_subscriptions(publisher)
            for i in range(500):
                publisher.publish(Int64(data=i))
        assert [(await anext(received)).data for _ in range(500)] == list(range(500))


async def test_another_type_on_the_same_topic_is_no_match(
    hub: broker.Broker, caplog: pytest.LogCaptureFixture
) -> None:
    """Nothing is delivered, and both sides warn with the topic and the types."""
    with caplog.at_level(logging.WARNING):
        async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
            publisher = talker.create_publisher(Int64, "numbers", 10)
            subscription = hearer.create_subscription(String, "numbers", qos_profile=10)
            await talker.get_graph()
            publisher.publish(Int64(data=1))
            await publisher.flush()
            await hearer.get_graph()
            await talker.get_graph()
            assert publisher.get_subscription_count() == 0
            assert subscription.received == subscription.queued == subscription.undecodable == 0
    warned = {record.name.rpartition(".")[2] for record in caplog.records if "numbers" in record.getMessage()}
    assert warned >= {"talker", "hearer"}
    assert "std_msgs/msg/String" in caplog.text
    assert "std_msgs/msg/Int64" in caplog.text


async def test_a_raw_subscription_receives_every_type(hub: broker.Broker) -> None:
    """With raw=True it matches publishers of any type."""
    async with actors.Node("talker", url=hub.url) as talker, actors.Node("hearer", url=hub.url) as hearer:
        publisher = talker.create_publisher(Int64, "numbers", 10)
        raw = aiter(hearer.create_subscription(None, "numbers", qos_profile=10, raw=True))
        await wait_for_subscriptions(publisher)
        publisher.publish(Int64(data=7))
        assert b"data" in await anext(raw)
