"""Deadline, lifespan, liveliness and events, each in the situation that tests it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from tests.seams import simulation as seams
from tests.simulation.network import BROKER
from tests.simulation.records import Note
from tests.simulation.stage import Stage, play
from tests.simulation.test_promises import matched
from tests.simulation.world import determined

if TYPE_CHECKING:
    from actors.endpoints.publisher.publisher import Publisher

MANUAL = actors.LivelinessPolicy.MANUAL_BY_TOPIC
LATCHED = actors.DurabilityPolicy.TRANSIENT_LOCAL
KEEP_ALL = actors.HistoryPolicy.KEEP_ALL


def ignore(message: Note) -> None:
    del message


def qos(**options: Any) -> actors.QoSProfile:
    return actors.QoSProfile(**{"depth": 10, **options})


async def beat(publisher: Publisher[Note], seconds: float, period: float) -> None:
    for number in range(round(seconds / period)):
        publisher.publish(Note(number=number))
        await asyncio.sleep(period)


def test_a_missed_deadline_is_reported_to_both_sides() -> None:
    """Each period without a message counts once, at the publisher and at the subscription."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        offered: list[actors.DeadlineMissedInfo] = []
        requested: list[actors.DeadlineMissedInfo] = []
        listener.create_subscription(
            Note,
            "red",
            ignore,
            qos(deadline=0.5),
            event_callbacks=actors.SubscriptionEventCallbacks(deadline=requested.append),
        )
        publisher = talker.create_publisher(
            Note,
            "red",
            qos(deadline=0.5),
            event_callbacks=actors.PublisherEventCallbacks(deadline=offered.append),
        )
        await matched(stage, publisher)
        await beat(publisher, 5, 0.4)
        assert offered == requested == []
        await asyncio.sleep(1.8)
        assert offered == [(1, 1), (2, 1), (3, 1), (4, 1)]
        assert requested == offered
        publisher.publish(Note())
        await asyncio.sleep(0.4)
        assert len(requested) == 4

    play(scene)


def test_a_deadline_holds_only_while_there_is_a_publisher() -> None:
    """No deadline is missed before the first publisher joins or after the last has left."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        missed: list[actors.DeadlineMissedInfo] = []
        listener.create_subscription(
            Note,
            "red",
            ignore,
            qos(deadline=0.5),
            event_callbacks=actors.SubscriptionEventCallbacks(deadline=missed.append),
        )
        await asyncio.sleep(3)
        assert not missed
        publisher = talker.create_publisher(Note, "red", qos(deadline=0.5))
        await matched(stage, publisher)
        await asyncio.sleep(0.7)
        assert missed == [(1, 1)]
        talker.destroy_publisher(publisher)
        await asyncio.sleep(3)
        assert missed == [(1, 1)]

    play(scene)


def test_nobody_is_late_while_there_is_no_broker() -> None:
    """Publishers leave with the connection; the deadline applies again after the next match."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        subscription = listener.create_subscription(Note, "red", ignore, qos(deadline=0.5))
        publisher = talker.create_publisher(Note, "red")
        await matched(stage, publisher)
        await stage.crash_broker()
        await stage.until(lambda: not listener.connected)
        missed = seams.subscription_events(subscription).deadline.counts
        assert missed == [0]
        await asyncio.sleep(10)
        assert missed == [0]
        await stage.start_broker()
        await matched(stage, publisher)
        await asyncio.sleep(0.7)
        assert missed == [1]

    play(scene)


@pytest.mark.parametrize("whole_node", [False, True])
def test_what_is_destroyed_counts_no_lease_and_no_deadline(*, whole_node: bool) -> None:
    """Destroying both ends during leases and deadlines causes no later miss."""

    async def scene(stage: Stage) -> None:
        both = await stage.enter("both")
        profile = qos(deadline=2, liveliness=MANUAL, liveliness_lease_duration=2.0)
        subscription = both.create_subscription(Note, "red", ignore, profile)
        publisher = both.create_publisher(
            Note, "red", profile, event_callbacks=actors.PublisherEventCallbacks(deadline=ignore)
        )
        await matched(stage, publisher)
        publisher.publish(Note())
        await asyncio.sleep(1)
        if whole_node:
            both.destroy_node()
        else:
            both.destroy_subscription(subscription)
            both.destroy_publisher(publisher)
        subscription_events = seams.subscription_events(subscription)
        publisher_events = endpoint_of(publisher).events
        assert publisher_events is not None
        before = [list(event.counts) for event in (*subscription_events.all(), *publisher_events.all())]
        await asyncio.sleep(10)
        assert [
            list(event.counts) for event in (*subscription_events.all(), *publisher_events.all())
        ] == before
        assert (
            subscription_events.liveliness.counts[1],
            subscription_events.deadline.counts,
            publisher_events.deadline.counts,
        ) == (
            0,
            [0],
            [0],
        )

    play(scene)


def test_a_subscription_gets_nothing_older_than_the_lifespan() -> None:
    """Messages that waited too long for a callback or a late joiner count as expired."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        profile = qos(depth=100, durability=LATCHED, lifespan=1.0)

        async def slow(message: Note) -> None:
            received.append(message.number)
            await asyncio.sleep(0.3)

        subscription = listener.create_subscription(Note, "red", slow, qos(depth=100))
        publisher = talker.create_publisher(Note, "red", profile)
        await matched(stage, publisher)
        with determined(stage.loop, 0):
            for number in range(10):
                publisher.publish(Note(number=number))
            await asyncio.sleep(5)
            assert received == [0, 1, 2, 3]
            assert (subscription.received, subscription.expired, subscription.queued) == (4, 6, 0)
            publisher.publish(Note(number=10))
            late = listener.create_subscription(
                Note, "red", lambda note: received.append(note.number), profile
            )
            await asyncio.sleep(1)
        assert received[4:] == [10, 10]
        assert (late.received, late.expired) == (1, 10)

    play(scene)


@pytest.mark.parametrize("kept", [True, False])
def test_an_iterator_gets_nothing_older_than_the_lifespan(*, kept: bool) -> None:
    """`async for` skips expired messages and returns their credit, also with KEEP_ALL."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        history = KEEP_ALL if kept else actors.HistoryPolicy.KEEP_LAST
        subscription = listener.create_subscription(
            Note, "red", qos_profile=qos(depth=50_000, history=history)
        )
        publisher = talker.create_publisher(Note, "red", qos(lifespan=1.0, history=history, depth=50_000))
        await matched(stage, publisher)
        for number in range(40_000):
            publisher.publish(Note(number=number))
            if number % 1000 == 999:
                await asyncio.sleep(0)
        await asyncio.sleep(10)
        received: list[int] = []

        async def read() -> None:
            async for note in subscription:
                received.append(note.number)  # noqa: PERF401 - as they come

        reader = asyncio.create_task(read())
        await asyncio.sleep(1)
        publisher.publish(Note(number=40_000))
        await asyncio.sleep(1)
        assert received[-1] == 40_000
        assert subscription.received + subscription.expired + subscription.dropped == 40_001
        assert subscription.expired > 30_000
        reader.cancel()
        await asyncio.wait({reader})

    play(scene)


def test_a_publisher_by_hand_is_alive_while_it_shows_itself() -> None:
    """Messages and assertions keep it alive; both sides learn of silence longer than its lease."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        lost: list[actors.LivelinessLostInfo] = []
        changed: list[actors.LivelinessChangedInfo] = []
        listener.create_subscription(
            Note,
            "red",
            ignore,
            qos(liveliness=MANUAL, liveliness_lease_duration=1.0),
            event_callbacks=actors.SubscriptionEventCallbacks(liveliness=changed.append),
        )
        publisher = talker.create_publisher(
            Note,
            "red",
            qos(liveliness=MANUAL, liveliness_lease_duration=1.0),
            event_callbacks=actors.PublisherEventCallbacks(liveliness=lost.append),
        )
        await matched(stage, publisher)
        await beat(publisher, 4, 0.8)
        for _ in range(5):
            publisher.assert_liveliness()
            await asyncio.sleep(0.8)
        assert not lost
        assert changed == [(1, 1, 0, 0)]
        await asyncio.sleep(5)
        assert lost == [(1, 1)]
        assert changed[1:] == [(0, -1, 1, 1)]
        publisher.assert_liveliness()
        await asyncio.sleep(0.5)
        assert changed[2:] == [(1, 1, 0, -1)]
        talker.destroy_publisher(publisher)
        await asyncio.sleep(5)
        assert changed[3:] == [(0, -1, 0, 0)]
        assert lost == [(1, 1)]

    play(scene)


@pytest.mark.parametrize("returns", [True, False])
def test_a_frozen_publisher_is_not_alive(*, returns: bool) -> None:
    """Publishers of a suspended node count as not alive until it is back or disconnected."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        changed: list[actors.LivelinessChangedInfo] = []
        listener.create_subscription(
            Note,
            "red",
            ignore,
            event_callbacks=actors.SubscriptionEventCallbacks(liveliness=changed.append),
        )
        publisher = talker.create_publisher(Note, "red")
        await matched(stage, publisher)
        stage.network.block("talker", BROKER)
        await asyncio.sleep(6)
        assert changed == [(1, 1, 0, 0), (0, -1, 1, 1)]
        if returns:
            stage.network.heal()
        await asyncio.sleep(40)
        assert changed[2:] == ([(1, 1, 0, -1)] if returns else [(0, 0, 0, -1)])

    play(scene)


def test_matches_are_counted_over_reconnects() -> None:
    """Totals only grow, and the current number is right, also over a broker restart."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        seen: list[actors.MatchedInfo] = []
        publisher = talker.create_publisher(
            Note, "red", event_callbacks=actors.PublisherEventCallbacks(matched=seen.append)
        )
        first = listener.create_subscription(Note, "red", ignore)
        await matched(stage, publisher)
        await asyncio.sleep(1)
        listener.create_subscription(Note, "red", ignore)
        await matched(stage, publisher, 2)
        await asyncio.sleep(1)
        listener.destroy_subscription(first)
        await matched(stage, publisher, 1)
        await asyncio.sleep(1)
        assert seen == [(1, 1, 1, 1), (2, 1, 2, 1), (2, 0, 1, -1)]
        await stage.crash_broker()
        await asyncio.sleep(1)
        assert seen[3:] == [(2, 0, 0, -1)]
        await stage.start_broker()
        await matched(stage, publisher, 1)
        await asyncio.sleep(1)
        assert seen[4:] == [(3, 1, 1, 1)]

    play(scene)


def test_lost_messages_are_reported() -> None:
    """Drops at a busy reader and in the broker raise events that add up to the counters."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        events: list[actors.MessageLostInfo] = []
        gate = asyncio.Event()

        async def slow(message: Note) -> None:
            await gate.wait()

        subscription = listener.create_subscription(
            Note,
            "red",
            slow,
            5,
            event_callbacks=actors.SubscriptionEventCallbacks(message_lost=events.append),
        )
        publisher = talker.create_publisher(Note, "red", 10)
        await matched(stage, publisher)
        stage.network.block(BROKER, "listener")
        for number in range(2000):
            publisher.publish(Note(number=number, weight=bytes(1000)))
            await asyncio.sleep(0.0005)
        stage.network.heal()
        await asyncio.sleep(2)
        gate.set()
        await asyncio.sleep(2)
        assert subscription.lost > 0
        assert subscription.dropped > 0
        assert events[-1].total_count == subscription.lost + subscription.dropped
        assert sum(info.total_count_change for info in events) == events[-1].total_count

    play(scene)


def test_misfits_are_reported_with_the_policy() -> None:
    """Both sides learn the incompatible policy or type; compatible messages are still delivered."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        misfits: list[Any] = []
        subscription_events = actors.SubscriptionEventCallbacks(
            incompatible_qos=misfits.append, incompatible_type=misfits.append
        )
        publisher_events = actors.PublisherEventCallbacks(
            incompatible_qos=misfits.append, incompatible_type=misfits.append
        )

        class Other(actors.Message, type_name="tests/msg/Other"):
            number: int = 0

        best_effort = qos(reliability=actors.ReliabilityPolicy.BEST_EFFORT)
        publisher = talker.create_publisher(Note, "red", best_effort, event_callbacks=publisher_events)
        await asyncio.sleep(0.1)
        listener.create_subscription(
            Note, "red", lambda note: received.append(note.number), event_callbacks=subscription_events
        )
        await matched(stage, publisher)
        publisher.publish(Note(number=1))
        await asyncio.sleep(0.5)
        assert received == [1]
        reliability = actors.QoSPolicyKind.RELIABILITY
        assert misfits == [(1, 1, reliability), (1, 1, reliability)]
        listener.create_subscription(Other, "red", lambda _: None, event_callbacks=subscription_events)
        await asyncio.sleep(0.5)
        assert misfits[2:] == [(1, 1), (1, 1)]
        assert publisher.get_subscription_count() == 1

    play(scene)
