"""One publisher, its subscribers: as fast as KEEP_ALL lets it, and nothing may be lost."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.bench.roles.messages import KEEP_ALL, KINDS
from actors.bench.roles.parent import Load
from actors.interfaces.std_msgs.msg import UInt64

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.bench.roles.parent import Parent

TOPIC: Final = "bench"
END_TOPIC: Final = "bench_end"
"""Carries how many messages there were, when they have all been published."""
BURST_BYTES: Final = 64 * 1024
BURST_MESSAGES: Final = 200
"""What is published before the loop gets its turn: whichever is less."""
GRACE_S: Final = 30.0
"""What consumers wait beyond the load's length."""


async def publisher(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish for `seconds`; then say how many there were."""
    size: int = parameters["size"]
    message = KINDS[parameters.get("kind", "plain")](size)
    burst = min(BURST_MESSAGES, max(1, BURST_BYTES // size))
    async with actors.Node("bench_publisher", url=parameters["url"]) as node:
        pub = node.create_publisher(type(message), TOPIC, KEEP_ALL)
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)
        await parent.told_to_go()
        await node.get_graph()  # behind our declarations, so what is there to match has been matched
        if pub.get_subscription_count() < parameters["readers"]:
            raise RuntimeError(f"only {pub.get_subscription_count()} subscriptions are matched")
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        sent = 0
        while time.perf_counter() < stop:
            for _ in range(burst):
                pub.publish(message)
            sent += burst
            await pub.ready()
            await asyncio.sleep(0)
        end.publish(UInt64(data=sent))
        await pub.flush()
        await end.flush()
        return load.figures(sent, sent=sent, lost=pub.dropped)


async def subscriber(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Count what comes on each of `subscriptions` subscriptions until everything is there."""
    copies: int = parameters["subscriptions"]
    message_type = type(KINDS[parameters.get("kind", "plain")](parameters["size"]))
    finished = asyncio.Event()
    count = 0
    alarm = 1
    expected = 0
    began = ended = 0.0

    def on_message(_: actors.Message) -> None:
        nonlocal count
        count += 1
        if count == alarm:
            first_or_last()

    def first_or_last() -> None:
        nonlocal alarm, began, ended
        ended = time.perf_counter()
        if alarm == 1:
            began = ended
        alarm = 0
        if count == expected:
            finished.set()

    def on_end(msg: UInt64) -> None:
        nonlocal alarm, expected
        alarm = expected = copies * msg.data
        if count >= expected:
            first_or_last()

    async with actors.Node(f"bench_subscriber_{parameters.get('number', 0)}", url=parameters["url"]) as node:
        held = [node.create_subscription(message_type, TOPIC, on_message, KEEP_ALL) for _ in range(copies)]
        node.create_subscription(UInt64, END_TOPIC, on_end, KEEP_ALL)
        await node.get_graph()  # behind our declarations: they are in force
        await parent.told_to_go()
        load = Load()
        async with asyncio.timeout(parameters["seconds"] + GRACE_S):
            await finished.wait()
        lost = sum(each.lost + each.lost_on_break + each.dropped + each.undecodable for each in held)
        elapsed_s = ended - began
        return load.figures(count, received=count, elapsed_s=elapsed_s, rate=count / elapsed_s, lost=lost)
