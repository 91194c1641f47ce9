"""Small messages at a fixed pace, and how late they come, while something large shares their broker."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.cli.bench.roles import percentiles_us
from actors.interfaces import types  # noqa: TC001 - read at run time
from benchmarks.harness.roles.messages import KEEP_ALL
from benchmarks.harness.roles.parent import Load
from benchmarks.harness.roles.stream import GRACE_S

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent

TOPIC: Final = "bench_tick"


class Tick(actors.Message, type_name="callboard_bench/msg/Tick"):
    """A small message with the time when it was sent. All processes of a machine share this clock."""

    sent_ns: types.uint64 = 0
    last: bool = False
    filling: str = ""


async def pacer(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish `per_second` messages a second; what a slow timer misses is made up for at once."""
    period_s = 1 / parameters["per_second"]
    total = round(parameters["seconds"] * parameters["per_second"])
    filling = "x" * parameters["filling"]
    async with actors.Node("bench_pacer", url=parameters["url"]) as node:
        pub = node.create_publisher(Tick, TOPIC, KEEP_ALL)
        await parent.ready()
        await node.get_graph()  # behind our declarations, so what is there to match has been matched
        load = Load()
        for number in range(total):
            wait_s = number * period_s - load.elapsed_s
            if wait_s > 0:
                await asyncio.sleep(wait_s)
            last = number == total - 1
            pub.publish(Tick(sent_ns=time.perf_counter_ns(), last=last, filling=filling))
        await pub.flush()
        return load.figures(total, sent=total)


async def listener(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Take the time from each message's publishing to its callback."""
    delays_s: list[float] = []
    finished = asyncio.Event()

    def on_tick(msg: Tick) -> None:
        delays_s.append((time.perf_counter_ns() - msg.sent_ns) / 1e9)
        if msg.last:
            finished.set()

    async with actors.Node("bench_listener", url=parameters["url"]) as node:
        node.create_subscription(Tick, TOPIC, on_tick, KEEP_ALL)
        await node.get_graph()  # behind our declarations: they are in force
        await parent.ready()
        load = Load()
        async with asyncio.timeout(parameters["seconds"] + GRACE_S):
            await finished.wait()
        return load.figures(len(delays_s), received=len(delays_s), **percentiles_us(delays_s))
