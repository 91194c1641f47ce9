"""A small random world: one broker, some nodes with everything nodes have, and what befalls them.

`World` is made from a seed and runs on a simulated loop. Each *member* stands for a process: a host of its
own, one node, and tasks that publish, call and wait. A member that dies comes back as a new process.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from contextlib import contextmanager
from random import Random
from typing import TYPE_CHECKING, Final
from unittest import mock

from broker.options import BrokerOptions
from broker.server import Broker
from tests.simulation import faults
from tests.simulation.member import Member
from tests.simulation.network import BROKER, Weather, on_host
from tests.simulation.records import Journal

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.simulation.loop import SimulatedLoop

CHAOS_SEC: Final = 15.0
"""How long the world publishes and calls, and suffers."""

STOP_SEC: Final = 15.0
"""A broker drains and stops within this."""

WEATHERS: Final = (
    Weather(),
    Weather(delay=0.0001, jitter=0.0),
    Weather(delay=0.02, jitter=0.03, segment=1500),
    Weather(segment=7, read=64, window=4096),
    Weather(segment=1500, window=2000),
    Weather(delay=0.005, jitter=0.1, segment=20_000, read=5_000),
)
"""Pipes' manners: from a fast wire to a slow one that hands out single bytes."""


@contextmanager
def determined(loop: SimulatedLoop, seed: int) -> Iterator[None]:
    """Clocks and chance that follow the loop and the seed: ids and stamps are part of what travels."""
    chance = Random(f"{seed} secrets")

    def now() -> int:
        return 1_700_000_000_000_000_000 + int(loop.time() * 1e9)

    with (
        mock.patch.object(time, "time_ns", now),
        mock.patch.object(time, "perf_counter", loop.time),
        mock.patch.object(secrets, "token_bytes", chance.randbytes),
    ):
        yield


class World:
    """The broker, the members and their fate.

    Attributes:
        calm: No faults, only weather.
        active: Whether members begin new things.
        stalled: Seconds for which everybody was frozen so far: deadlines cannot be met in them.
    """

    def __init__(self, loop: SimulatedLoop, seed: int, *, calm: bool) -> None:
        self.loop = loop
        self.network = loop.network
        self.network.choose_weather = lambda random: Weather(**vars(random.choice(WEATHERS)))
        self.calm = calm
        self.seed = seed
        self.journal = Journal()
        self.random = Random(f"{seed} world")
        self.active = True
        self.stalled = 0.0
        self.broker: Broker | None = None
        self._broker_task: asyncio.Task[None] | None = None
        self._broker_stop = asyncio.Event()
        self._broker_up = asyncio.Event()
        self.members: list[Member] = [
            Member(self, f"member{number}", Random(f"{seed} member {number}"))
            for number in range(self.random.randint(2, 4))
        ]

    def note(self, text: str) -> None:
        """Write something down, into the network's trace, too."""
        self.journal.events.append(f"{self.loop.time():10.6f} {text}")
        self.network.note(text)

    def complain(self, text: str) -> None:
        """Something is wrong; the history fails with this text."""
        self.note(f"WRONG: {text}")
        self.journal.complaints.append(f"at {self.loop.time():.6f} s: {text}")

    def stall(self, seconds: float) -> None:
        """Freeze every process for a while."""
        self.stalled += seconds
        self.loop.stall(seconds)

    # The broker's life

    async def start_broker(self) -> None:
        """Start a broker at the world's address."""
        self.note("start broker")
        self._broker_stop, self._broker_up = asyncio.Event(), asyncio.Event()
        with on_host(BROKER):
            self._broker_task = asyncio.create_task(self._run_broker(), name="broker")
        up = asyncio.create_task(self._broker_up.wait())
        await asyncio.wait({up, self._broker_task}, return_when=asyncio.FIRST_COMPLETED)
        up.cancel()
        if self._broker_task.done():
            await self._broker_task

    async def _run_broker(self) -> None:
        async with Broker(BrokerOptions()) as self.broker:
            self._broker_up.set()
            await self._broker_stop.wait()

    async def stop_broker(self) -> None:
        """Let the broker drain and end."""
        assert self._broker_task is not None
        self.note("stop broker")
        began, stalled = self.loop.time(), self.stalled
        self._broker_stop.set()
        await self._broker_task
        took = self.loop.time() - began - (self.stalled - stalled)
        if took > STOP_SEC:
            self.complain(f"the broker took {took:.3f} s to stop")

    async def crash_broker(self, *, silent: bool) -> None:
        """End the broker as a dead process, or a machine without power, ends."""
        assert self._broker_task is not None
        self.note(f"crash broker, silent: {silent}")
        self.network.crash(BROKER, silent=silent)
        self._broker_task.cancel()
        await asyncio.wait({self._broker_task})

    # The history

    async def run(self) -> None:
        """Start everything, let it happen, heal."""
        late = not self.calm and self.random.random() < 0.3
        if not late:
            await self.start_broker()
        for member in self.members:
            member.start()
            await asyncio.sleep(0 if self.calm else self.random.random())
        if late:
            await asyncio.sleep(3 * self.random.random())
            await self.start_broker()
        end = self.loop.time() + CHAOS_SEC
        if not self.calm:
            together = self.random.random() < 0.3
            if together:
                await asyncio.gather(
                    self._suffer(faults.OF_THE_NETWORK, end), self._suffer(faults.OF_PROCESSES, end)
                )
            else:
                await self._suffer((*faults.OF_THE_NETWORK, *faults.OF_PROCESSES), end)
            self.network.heal()
        await asyncio.sleep(max(0.0, end - self.loop.time()))
        self.note("quiet")
        self.active = False
        for member in self.members:
            await member.activities_end()

    async def _suffer(self, kind: tuple[faults.Fault, ...], end: float) -> None:
        while self.loop.time() < end:
            await asyncio.sleep(self.random.expovariate(0.5))
            await faults.strike(self, kind)
