"""One publisher, its subscribers: as fast as KEEP_ALL lets it or at a pace, and nothing may be lost."""

from __future__ import annotations

import asyncio
import math
import time
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.std_msgs.msg import UInt64
from benchmarks.harness.roles.messages import KEEP_ALL, KINDS
from benchmarks.harness.roles.parent import Load

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from benchmarks.harness.roles.parent import Parent

TOPIC: Final = "bench"
END_TOPIC: Final = "bench_end"
"""Carries how many messages there were, when they have all been published."""
BURST_BYTES: Final = 64 * 1024
BURST_MESSAGES: Final = 200
"""What is published before the loop gets its turn: whichever is less."""
GRACE_S: Final = 30.0
"""What consumers wait beyond the load's length."""


class Count:
    """Counts messages on `copies` subscriptions, and takes the time of the first and the last of them."""

    def __init__(self, copies: int) -> None:
        self._copies = copies
        self.received = 0
        self._alarm = 1
        """The count at which to read the clock."""
        self._expected = 0
        self._began = self._ended = 0.0
        self._finished = asyncio.Event()

    def on_message(self, _: object) -> None:
        """Count one."""
        self.received += 1
        if self.received == self._alarm:
            self._read_clock()

    def _read_clock(self) -> None:
        self._ended = time.perf_counter()
        if self.received == 1:
            self._began = self._ended
        self._alarm = self._expected
        if self.received == self._expected:
            self._finished.set()

    def on_end(self, msg: UInt64) -> None:
        """Learn how many there are: may come before the last of them, as topics have no common order."""
        self._expected = self._copies * msg.data
        if self.received >= self._expected:
            self._read_clock()
        elif self.received:
            self._alarm = self._expected

    async def wait(self, timeout_s: float) -> None:
        """Wait until all are there.

        Raises:
            TimeoutError: They are not within `timeout_s`.
        """
        async with asyncio.timeout(timeout_s):
            await self._finished.wait()

    def figures(self, subscriptions: Sequence[actors.Subscription[Any]]) -> dict[str, float]:
        """Return what a subscriber reports."""
        lost = sum(each.lost + each.lost_on_break + each.dropped + each.undecodable for each in subscriptions)
        elapsed_s = self._ended - self._began
        rate = self.received / elapsed_s if elapsed_s else 0.0
        return {"received": self.received, "elapsed_s": elapsed_s, "rate": rate, "lost": lost}


async def publisher(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish for `seconds`, at most `messages` of them, at most `mb_s`; then send how many there were.

    It publishes one message again and again, unless each is to be made `anew`, and `burst` in a loop turn.
    """
    size: int = parameters["size"]
    make = KINDS[parameters.get("kind", "plain")]
    message = make(size)
    anew: bool = parameters.get("anew", False)
    burst: int = parameters.get("burst") or min(BURST_MESSAGES, max(1, BURST_BYTES // size))
    most = parameters.get("messages", math.inf)
    pause_s = burst * size / (1e6 * parameters["mb_s"]) if "mb_s" in parameters else 0.0
    async with actors.Node("bench_publisher", url=parameters["url"]) as node:
        pub = node.create_publisher(type(message), TOPIC, KEEP_ALL)
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)
        await parent.ready()
        await node.get_graph()  # behind our declarations, so what is there to match has been matched
        if pub.get_subscription_count() < parameters["readers"]:
            raise RuntimeError(f"only {pub.get_subscription_count()} subscriptions are matched")
        load = Load()
        began = time.perf_counter()
        stop = began + parameters["seconds"]
        sent = 0
        while (now := time.perf_counter()) < stop and sent < most:
            for _ in range(burst):
                pub.publish(make(size) if anew else message)
            sent += burst
            await pub.ready()
            due = began + pause_s * (sent // burst)
            await asyncio.sleep(max(0.0, due - now))
        end.publish(UInt64(data=sent))
        await pub.flush()
        await end.flush()
        return load.figures(sent, sent=sent, lost=pub.dropped)


async def subscriber(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Count what comes on `subscriptions` subscriptions, held by `nodes` nodes, until everything is there."""
    copies: int = parameters["subscriptions"]
    message_type = type(KINDS[parameters.get("kind", "plain")](parameters["size"]))
    count = Count(copies)
    async with AsyncExitStack() as stack:
        nodes = [
            await stack.enter_async_context(
                actors.Node(f"bench_subscriber_{parameters.get('number', 0)}_{index}", url=parameters["url"])
            )
            for index in range(parameters.get("nodes", 1))
        ]
        held = [
            nodes[index % len(nodes)].create_subscription(message_type, TOPIC, count.on_message, KEEP_ALL)
            for index in range(copies)
        ]
        nodes[0].create_subscription(UInt64, END_TOPIC, count.on_end, KEEP_ALL)
        for node in nodes:
            await node.get_graph()  # behind its declarations: they are in force
        await parent.ready()
        load = Load()
        await count.wait(parameters["seconds"] + GRACE_S)
        return {**load.figures(count.received), **count.figures(held)}
