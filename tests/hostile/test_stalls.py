"""KEEP_ALL readers that take nothing: publishers wait for them for a while, and no longer."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from broker import BrokerOptions
from proto.limited_log import MAX_LINES
from tests.simulation.records import Note
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    import pytest

    from actors.endpoints.publisher.publisher import Publisher

KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
COUNT = 60_000
"""Messages: more than the window of a subscription."""


async def publish(stage: Stage, publisher: Publisher[Note]) -> None:
    """Publish as fast as the readers allow."""
    await stage.until(lambda: publisher.get_subscription_count() == 2)
    for number in range(COUNT):
        if not number % 500:
            await publisher.ready(timeout_sec=1000)
        publisher.publish(Note(number=number))


def stalled(caplog: pytest.LogCaptureFixture) -> int:
    """Return how many lines say that a subscription has taken nothing."""
    return sum("has taken nothing" in record.getMessage() for record in caplog.records)


def test_a_subscription_that_nobody_iterates_delays_a_topic_and_does_not_silence_it(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Case 44: after the time limit the others get everything; the reader learns of it and may return."""

    async def scene(stage: Stage) -> None:
        talker, idle = await stage.enter("talker"), await stage.enter("idle")
        good = await stage.enter("good")
        received: list[int] = []
        good.create_subscription(Note, "red", lambda message: received.append(message.number), KEEP_ALL)
        forgotten = idle.create_subscription(Note, "red", qos_profile=KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        began = stage.loop.time()
        await publish(stage, publisher)
        await stage.until(lambda: len(received) == COUNT, 100, step=0.1)
        assert received == list(range(COUNT))
        assert 60 < stage.loop.time() - began < 70
        assert stage.broker.stats().stalls == 1
        assert stalled(caplog) == 3  # in the logs of the broker, the publisher and the reader
        held = forgotten.queued
        iterator = aiter(forgotten)
        taken = [(await anext(iterator)).number for _ in range(held)]
        assert taken == list(range(held))
        await asyncio.sleep(2)
        publisher.publish(Note(number=COUNT))
        assert (await anext(iterator)).number == COUNT
        assert forgotten.lost + forgotten.lost_on_break == COUNT - held

    play(scene)


def test_a_slow_subscription_does_not_stall(caplog: pytest.LogCaptureFixture) -> None:
    """Case 44: a reader that takes a message now and then holds its publishers back for any time."""

    async def scene(stage: Stage) -> None:
        talker, slow = await stage.enter("talker"), await stage.enter("slow")
        other = await stage.enter("other")
        other.create_subscription(Note, "red", lambda message: None, KEEP_ALL)

        async def take(_: Note) -> None:
            await asyncio.sleep(20)

        slow.create_subscription(Note, "red", take, KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        task = asyncio.create_task(publish(stage, publisher))
        await asyncio.sleep(300)
        assert not task.done()
        task.cancel()
        assert stalled(caplog) == 0

    play(scene)


def test_a_subscription_may_ask_for_more_time(caplog: pytest.LogCaptureFixture) -> None:
    """Case 44: stall_timeout_sec holds, up to the broker's maximum."""

    async def scene(stage: Stage) -> None:
        talker, idle = await stage.enter("talker"), await stage.enter("idle")
        for seconds in (50.0, 1000.0):
            idle.create_subscription(Note, "red", qos_profile=KEEP_ALL, stall_timeout_sec=seconds)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        task = asyncio.create_task(publish(stage, publisher))
        await asyncio.sleep(45)
        assert stalled(caplog) == 0
        await asyncio.sleep(10)
        assert stalled(caplog) == 3
        assert not task.done()
        await asyncio.sleep(50)
        assert stalled(caplog) == 6
        await task

    play(scene, options=BrokerOptions(keep_all_stall_sec=10, keep_all_stall_max_sec=100))


def test_many_stalls_are_few_lines(caplog: pytest.LogCaptureFixture) -> None:
    """Case 44: subscriptions that stall together cannot fill the broker's log."""

    async def scene(stage: Stage) -> None:
        talker, idle = await stage.enter("talker"), await stage.enter("idle")
        for _ in range(30):
            idle.create_subscription(Note, "red", qos_profile=KEEP_ALL)
        publisher = talker.create_publisher(Note, "red", KEEP_ALL)
        await stage.until(lambda: publisher.get_subscription_count() == 30)
        for number in range(COUNT):
            if not number % 500:
                await publisher.ready(timeout_sec=1000)
            publisher.publish(Note(number=number))
        await asyncio.sleep(15)

    play(scene, options=BrokerOptions(keep_all_stall_sec=10))
    lines = [each.getMessage() for each in caplog.records if each.name == "callboard.broker"]
    assert sum("has taken nothing" in line for line in lines) == MAX_LINES
    assert f"… and {30 - MAX_LINES} more like this: stalled subscriptions" in lines
