"""A node that logs, and a reader of `/rosout` that counts what arrives and what was dropped."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_msgs.msg import UInt64
from actors.qos.profile import qos_profile_rosout_default
from benchmarks.harness.roles.messages import KEEP_ALL
from benchmarks.harness.roles.parent import Load
from benchmarks.harness.roles.stream import END_TOPIC, GRACE_S

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent

TEXT: Final = 'Publishing: "a line of the usual length, with a number: 1234567"'


async def log_writer(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Log for `seconds`, `burst` lines in a loop turn, to `/rosout` alone; then send how many there were."""
    logging.getLogger("callboard").addHandler(logging.NullHandler())  # printing is not what is measured
    readers: int = parameters["readers"]
    async with actors.Node(
        "bench_log_writer", url=parameters["url"], enable_rosout=parameters["rosout"]
    ) as node:
        end = node.create_publisher(UInt64, END_TOPIC, KEEP_ALL)
        await parent.ready()
        await end.wait_for_subscriptions(readers)
        log = node.get_logger()
        logged = 0
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        while time.perf_counter() < stop:
            for _ in range(parameters["burst"]):
                log.info(TEXT)
            logged += parameters["burst"]
            await asyncio.sleep(0)
        figures = load.figures(logged, rate=logged / load.elapsed_s)
        found = [each for each in node.diagnostics().publishers if each.topic == "/rosout"]
        end.publish(UInt64(data=logged))
        await end.flush()
        return {**figures, "dropped": sum(each.dropped for each in found)}


async def log_reader(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Count the lines until all have arrived, or are known to be lost."""
    received = 0
    first_s = last_s = 0.0
    expected: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def on_line(_: Log) -> None:
        nonlocal received, first_s, last_s
        last_s = time.perf_counter()
        first_s = first_s or last_s
        received += 1

    def on_end(end: UInt64) -> None:
        expected.set_result(end.data)

    async with actors.Node("bench_log_reader", url=parameters["url"], enable_rosout=False) as node:
        lines = node.create_subscription(Log, "/rosout", on_line, qos_profile_rosout_default)
        node.create_subscription(UInt64, END_TOPIC, on_end, KEEP_ALL)
        await node.get_graph()  # behind our declarations: they are in force
        await parent.ready()
        load = Load()
        async with asyncio.timeout(parameters["seconds"] + GRACE_S):
            logged = await expected
            while received + lines.lost + lines.dropped < logged:  # noqa: ASYNC110 - losses cause no event
                await asyncio.sleep(0.001)
        lost = lines.lost + lines.dropped
        rate = received / (last_s - first_s) if last_s > first_s else 0.0
        return load.figures(received, received=received, lost=lost, rate=rate)
