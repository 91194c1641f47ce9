"""A small random world: one or two brokers, some nodes with all kinds of endpoints, and their faults.

`World` is made from a seed and runs on a simulated loop. Each *member* simulates a process: a host of its
own, one node, and tasks that publish, call and wait. A member that dies returns as a new process.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from contextlib import contextmanager, nullcontext, suppress
from random import Random
from typing import TYPE_CHECKING, Final
from unittest import mock

from actors.endpoints.publisher import queue_limits
from actors.endpoints.subscription import credit
from broker.options import BrokerOptions
from tests.simulation import faults
from tests.simulation.brokers import BrokerProcess
from tests.simulation.hostile import Attacker, StalledReader
from tests.simulation.member import Member
from tests.simulation.network import BROKER, LinkFaults
from tests.simulation.records import Journal
from tests.simulation.shared_memory import simulated_arenas
from tests.simulation.steps import Steps

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.simulation.loop import SimulatedLoop
    from tests.simulation.records import PublisherHistory, SubscriptionHistory

CHAOS_SEC: Final = 15.0
"""How long the world publishes and calls, and suffers."""

CANCEL_SEC: Final = 0.7
"""A cancellation reaches a handler within this, through the worst link faults."""

CEILINGS: Final = (65_536, 200_000)
"""Bytes that may wait for one link, in some troubled histories: queues lose messages, and links end."""

HOSTILE_SHARE: Final = 0.3
"""Histories with one or two attackers, and as many with a KEEP_ALL reader that stalls."""

LINK_FAULTS: Final = (
    LinkFaults(),
    LinkFaults(delay=0.0001, jitter=0.0),
    LinkFaults(delay=0.02, jitter=0.03, segment=1500),
    LinkFaults(segment=7, read=64, window=4096),
    LinkFaults(segment=1500, window=2000),
    LinkFaults(delay=0.005, jitter=0.1, segment=20_000, read=5_000),
)
"""Link faults: from a fast wire to a slow one that hands out single bytes."""


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
        mock.patch.object(secrets, "randbelow", chance.randrange),
        simulated_arenas(seed),
    ):
        yield


@contextmanager
def tight(random: Random) -> Iterator[None]:
    """Limits that a history reaches: credit runs out, and publishers get full."""
    with (
        mock.patch.object(credit, "WINDOW_MESSAGES", random.choice([4, 30, 1000])),
        mock.patch.object(credit, "WINDOW_BYTES", random.choice([500, 20_000, 8 * 1024 * 1024])),
        mock.patch.object(queue_limits, "KEEP_ALL_MESSAGES", random.choice([40, 400])),
        mock.patch.object(queue_limits, "READY_MESSAGES", random.choice([1, 20])),
    ):
        yield


class World:
    """The brokers, the members and their fate.

    Attributes:
        calm: No faults except those of links (delays, small segments).
        alone: Whether at most one fault strikes at a time.
        active: Whether members begin new things.
        home: The broker that everybody prefers.
        standby: A second one, for those that do not reach the first; in some histories.
        max_link_bytes: What may wait in a broker for one link.
        large_share: How many messages are large ones.
        cancel_sec: How long a cancellation may take to reach a handler.
        steps: What is checked all the time.
    """

    def __init__(self, loop: SimulatedLoop, seed: int, *, calm: bool) -> None:
        self.loop = loop
        self.network = loop.network
        self.network.choose_link_faults = lambda random: LinkFaults(**vars(random.choice(LINK_FAULTS)))
        self.calm = calm
        self.alone = True
        self.seed = seed
        self.journal = Journal()
        self.random = Random(f"{seed} world")
        self.active = True
        self.large_share = Random(f"{seed} large").choice([0.005, 0.005, 0.1])
        self.cancel_sec = CANCEL_SEC
        self._stalled = 0.0
        self._frozen_since: dict[str, float] = {}
        self._frozen_for: dict[str, float] = {}
        self.max_link_bytes = BrokerOptions().max_link_bytes
        chance = Random(f"{seed} ceiling")
        if not calm and chance.random() < 0.4:
            self.max_link_bytes = chance.choice(CEILINGS)
        self.home = BrokerProcess(self, BROKER, 7411)
        self.standby: BrokerProcess | None = None
        if not calm and self.random.random() < 0.25:
            self.standby = BrokerProcess(self, "standby", 7412)
        self.members: list[Member] = [
            Member(self, f"member{number}", Random(f"{seed} member {number}"))
            for number in range(self.random.randint(2, 4))
        ]
        self.steps = Steps(self)
        hostile = Random(f"{seed} hostile")
        self._attackers = [
            Attacker(self, f"attacker{number}", hostile)
            for number in range(hostile.choice([1, 2]) if hostile.random() < HOSTILE_SHARE else 0)
        ]

        stalls = Random(f"{seed} stalls")
        self._stalled_reader = StalledReader(self, stalls) if stalls.random() < HOSTILE_SHARE else None
        self._stalling: asyncio.Task[None] | None = None

    @property
    def url(self) -> str:
        """The URLs of the brokers that the members connect to."""
        return self.home.url if self.standby is None else f"{self.home.url},{self.standby.url}"

    @property
    def brokers(self) -> list[BrokerProcess]:
        """All of them."""
        return [self.home] if self.standby is None else [self.home, self.standby]

    @property
    def backed_up(self) -> bool:
        """Whether a broker has more to send to others than its network takes."""
        return False

    def live_from(self, pub: PublisherHistory, sub: SubscriptionHistory) -> int:
        """Return the number before which a publisher's messages may have been replaced by newer ones."""
        return 0

    def lost_between_brokers(self, pub: PublisherHistory, sub: SubscriptionHistory) -> set[int]:
        """Return the numbers of a publisher's messages that no broker could forward to a subscription's."""
        return set()

    def record(self, text: str) -> None:
        """Write something down, into the network's trace, too."""
        self.journal.events.append(f"{self.loop.time():10.6f} {text}")
        self.network.record(text)

    def complain(self, text: str) -> None:
        """Something is wrong; the history fails with this text."""
        self.record(f"WRONG: {text}")
        self.journal.complaints.append(f"at {self.loop.time():.6f} s: {text}")

    # Processes that do not run

    def stall(self, seconds: float) -> None:
        """Freeze every process for a while."""
        self._stalled += seconds
        self.loop.stall(seconds)

    def freeze(self, host: str) -> None:
        """Stop one process, until `thaw`."""
        self._frozen_since.setdefault(host, self.loop.time())
        self.loop.freeze(host)

    def thaw(self, host: str) -> None:
        """Let a process go on, if it was stopped."""
        since = self._frozen_since.pop(host, None)
        if since is not None:
            self._frozen_for[host] = self._frozen_for.get(host, 0.0) + self.loop.time() - since
            self.loop.thaw(host)

    def heal(self) -> None:
        """The network is well, and everybody runs."""
        self.network.heal()
        for host in tuple(self._frozen_since):
            self.thaw(host)

    def lost_time(self, host: str) -> float:
        """Return for how many seconds a process did not run so far: it cannot meet a deadline in them."""
        return self._stalled + self._frozen_for.get(host, 0.0)

    # The history

    @contextmanager
    def limits(self) -> Iterator[None]:
        """Limits for this history: those of the product, or tight ones."""
        random = Random(f"{self.seed} limits")
        with tight(random) if random.random() < 0.5 else nullcontext():
            yield

    async def run(self) -> None:
        """Start everything, let it happen, heal."""
        late = not self.calm and self.random.random() < 0.3
        if self.standby is not None:
            await self.standby.start()
        if not late:
            await self.home.start()
        for member in self.members:
            member.start()
            await asyncio.sleep(0 if self.calm else self.random.random())
        if late:
            await asyncio.sleep(3 * self.random.random())
            await self.home.start()
        attacks = [asyncio.create_task(attacker.run()) for attacker in self._attackers]
        if self._stalled_reader is not None:
            self._stalling = asyncio.create_task(self._stalled_reader.run())
        end = self.loop.time() + CHAOS_SEC
        if self.calm:
            await faults.intrude(self, self.random.choice(self.members), 1.0)
        else:
            await self._suffer_all(end)
            self.heal()
        await asyncio.sleep(max(0.0, end - self.loop.time()))
        for attack in attacks:
            await _end(attack)
        if self.standby is not None:
            await self.standby.stop()
        self.record("quiet")
        self.active = False
        for member in self.members:
            await member.activities_end()

    async def end_stalls(self) -> None:
        """End the reader that stalls; until then nobody waits for it for long."""
        if self._stalling is not None:
            await _end(self._stalling)

    async def _suffer_all(self, end: float) -> None:
        self.alone = self.random.random() < 0.7
        if not self.alone:
            await asyncio.gather(
                self._suffer(faults.OF_THE_NETWORK, end), self._suffer(faults.OF_PROCESSES, end)
            )
        else:
            await self._suffer((*faults.OF_THE_NETWORK, *faults.OF_PROCESSES), end)

    async def _suffer(self, kind: tuple[faults.Fault, ...], end: float) -> None:
        while self.loop.time() < end:
            await asyncio.sleep(self.random.expovariate(0.5))
            await faults.strike(self, kind)


async def _end(task: asyncio.Task[None]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
