"""The wall clock jumps by days, forwards and backwards, without any effect on nodes and brokers."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING

import actors
from actors.interfaces.std_msgs.msg import Int64

if TYPE_CHECKING:
    from tests.integration.conftest import System

JUMPING = """
import itertools, time

real_ns = time.time_ns
days = itertools.cycle([0, 1, -1, 400, -400])

def jumping_ns():
    return real_ns() + next(days) * 86_400 * 10**9

time.time_ns = jumping_ns
time.time = lambda: jumping_ns() / 1e9
"""

BROKER = (
    JUMPING
    + """
import runpy
runpy.run_module("broker", run_name="__main__")
"""
)

NODE = (
    JUMPING
    + """
import asyncio
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64

class Jumper(actors.Node):
    def __init__(self):
        super().__init__("jumper")
        self.numbers = self.create_publisher(Int64, "numbers", 1000)
        self.client = self.create_client(AddTwoInts, "never")
        self.create_service(AddTwoInts, "never", self.never, concurrent=True)

    async def never(self, request):
        await asyncio.Event().wait()

async def main():
    clock = time.monotonic
    async with Jumper() as node:
        assert await node.client.wait_for_service(30)
        began = clock()
        try:
            await node.client.call(AddTwoInts.Request(), timeout_sec=0.5)
        except actors.ServiceTimeout:
            print("deadline", clock() - began, flush=True)
        absent = node.create_client(AddTwoInts, "absent")
        began = clock()
        assert not await absent.wait_for_service(timeout_sec=0.3)
        print("wait", clock() - began, flush=True)
        while not node.numbers.get_subscription_count():
            await node.get_graph()
        began, ticked = clock(), asyncio.Event()
        def tick():
            node.numbers.publish(Int64(data=timer.ticks))
            if timer.ticks == 40:
                ticked.set()
        timer = node.create_timer(0.05, tick)
        await ticked.wait()
        print("ticks", clock() - began, flush=True)
        await asyncio.Event().wait()

actors.run(main)
"""
)
SLOW_SEC = 20.0
"""Longer than a busy machine takes for what should take two seconds at most; much less than a day."""


async def test_nothing_depends_on_the_wall_clock(system: System) -> None:
    """Case 37: deadlines, waits and timers are on time, no node is suspended, messages keep order."""
    daemon = await system.python("-c", BROKER, "--port", str(system.port), "--keepalive-sec", "10")
    await daemon.wait_for_line("listening on")
    async with actors.Node("hearer", url=system.url) as node:
        received = aiter(node.create_subscription(Int64, "numbers", qos_profile=1000))
        jumper = await system.python("-c", NODE)
        for what, least in (("deadline", 0.5), ("wait", 0.3), ("ticks", 40 * 0.05)):
            took = float((await jumper.wait_for_line(what)).split()[1])
            assert 0.99 * least <= took < SLOW_SEC, what
        async with asyncio.timeout(SLOW_SEC):
            numbers = [(await anext(received)).data for _ in range(40)]
        assert numbers == list(range(1, 41))
        began = time.monotonic()
        await jumper.kill()
        while "/jumper" in await node.get_fully_qualified_node_names():
            assert time.monotonic() - began < SLOW_SEC
    for program in (daemon, jumper):
        assert "silent" not in program.output
        assert "No broker" not in program.output
        assert "Traceback" not in program.output
