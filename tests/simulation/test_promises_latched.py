"""Latched messages that a publisher sends again stay old, however often its connection breaks."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

import actors
from actors.endpoints.endpoint import endpoint_of
from tests.simulation.network import BROKER
from tests.simulation.records import Note
from tests.simulation.stage import Stage, play
from tests.simulation.test_promises import LATCHED, matched

if TYPE_CHECKING:
    from collections.abc import Callable

COUNT: Final = 300
WEIGHT: Final = bytes(10_000)
"""So many and so large that a new link has taken a part of them when it breaks."""


async def publish_all(publisher: actors.Publisher[Note], stage: Stage, received: list[int]) -> None:
    """Publish, a little at a time, until all have been received."""
    for number in range(COUNT):
        publisher.publish(Note(number=number, weight=WEIGHT))
        await asyncio.sleep(0.002)
    await stage.until(lambda: len(received) == COUNT)


async def break_while_it_sends_again(
    stage: Stage, publisher: actors.Publisher[Note], meanwhile: Callable[[], object] = lambda: None
) -> None:
    """Let a link end, and the next one, too, while the publisher sends again; do something between them."""
    talker = endpoint_of(publisher).context.link
    await stage.crash_broker()
    await stage.until(lambda: talker.channel is None)
    await stage.start_broker()
    await stage.until(lambda: endpoint_of(publisher).accepted_now)
    assert 0 < publisher.queued < COUNT
    await stage.crash_broker()
    await stage.until(lambda: talker.channel is None)
    assert (publisher.queued, publisher.dropped) == (0, 0)
    meanwhile()
    await stage.start_broker()


def test_what_is_sent_again_after_a_second_break_is_not_new() -> None:
    """A VOLATILE subscription made between two breaks receives only what is published later."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        old: list[int] = []
        fresh: list[int] = []
        publisher = talker.create_publisher(Note, "map", actors.QoSProfile(depth=400, durability=LATCHED))
        before = listener.create_subscription(Note, "map", lambda message: old.append(message.number), 400)
        await matched(stage, publisher)
        await publish_all(publisher, stage, old)

        def subscribe() -> None:
            listener.create_subscription(Note, "map", lambda message: fresh.append(message.number), 400)
            stage.network.block("talker", BROKER)  # the listener is back first

        await break_while_it_sends_again(stage, publisher, subscribe)
        await stage.until(lambda: listener.connected)
        stage.network.heal()
        await matched(stage, publisher, 2)
        publisher.publish(Note(number=COUNT))
        await stage.until(lambda: bool(fresh) and fresh[-1] == COUNT, 30)
        assert fresh == [COUNT]
        assert old == list(range(COUNT + 1))
        assert (before.lost, before.lost_on_break, before.dropped) == (0, 0, 0)

    play(scene)


def test_what_has_been_received_is_not_dropped_when_it_waits_to_be_sent_again() -> None:
    """New messages displace repeated ones, and only messages never sent count as dropped."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        received: list[int] = []
        publisher = talker.create_publisher(Note, "map", actors.QoSProfile(depth=COUNT, durability=LATCHED))
        subscription = listener.create_subscription(
            Note, "map", lambda message: received.append(message.number), 400
        )
        await matched(stage, publisher)
        await publish_all(publisher, stage, received)

        def publish_more() -> None:
            for number in range(COUNT, COUNT + 100):
                publisher.publish(Note(number=number))

        await break_while_it_sends_again(stage, publisher, publish_more)
        await stage.until(lambda: received[-1] == COUNT + 99)
        assert received == list(range(COUNT + 100))
        assert (publisher.dropped, subscription.lost, subscription.lost_on_break) == (0, 0, 0)

    play(scene)
