"""A random world of three to five brokers in a mesh: each member connects to one of them.

Members publish, call and wait as in other worlds, and the same checks apply, over the sums of all brokers.
"""

from __future__ import annotations

import asyncio
from contextlib import contextmanager, nullcontext
from random import Random
from typing import TYPE_CHECKING, Final
from unittest import mock

import actors
from actors.endpoints.endpoint import endpoint_of
from broker.mesh import slices
from broker.mesh.engine import member as engine_member
from broker.options import BrokerOptions
from tests.simulation import faults
from tests.simulation.brokers import BrokerProcess
from tests.simulation.member import Member
from tests.simulation.mesh_network import FAST_RATES, LEASE_SEC, MAX_DELAY_SEC, SLOW_RATES, MeshNetwork
from tests.simulation.network import on_host
from tests.simulation.world import CHAOS_SEC, World

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.simulation.faults import Fault
    from tests.simulation.loop import SimulatedLoop
    from tests.simulation.records import PublisherHistory, SubscriptionHistory

SLOW_SEC: Final = 3.0
"""What an engine is full of, and a large message or two, need at the lowest rate."""

SETTLE_SEC: Final = 20.0
"""Brokers that can reach each other have agreed within this: some requests are unanswered for 6 s."""


class MeshWorld(World):
    """Brokers in a mesh, members of each, and their fate.

    Attributes:
        mesh: The network between the brokers.
    """

    def __init__(self, loop: SimulatedLoop, seed: int, *, calm: bool) -> None:
        super().__init__(loop, seed, calm=calm)
        random = self.random = Random(f"{seed} mesh world")
        self.standby = None
        # Not a tiny one: what other brokers have latched comes at once, however slow its first reader is.
        self.max_link_bytes = BrokerOptions().max_link_bytes
        self.mesh = MeshNetwork(loop, seed)
        self.mesh.handled = self.steps.check_routers
        self.mesh.unanswered = 0.0 if calm else random.choice([0.0, 0.0, 0.3])
        slow = Random(f"{seed} rates").random() < 0.5
        self.mesh.rates = SLOW_RATES if slow else FAST_RATES
        # A cancellation waits behind large messages in a slow engine.
        self.cancel_sec += SLOW_SEC if slow else MAX_DELAY_SEC
        self._brokers = [
            BrokerProcess(self, f"broker{number}", 7411 + number, self.mesh)
            for number in range(random.randint(3, 5))
        ]
        self.home = self._brokers[0]
        places = [*self._brokers, *random.choices(self._brokers, k=random.randint(0, 2))]
        self.members = [
            Member(self, f"member{number}", Random(f"{seed} member {number}"), process.url)
            for number, process in enumerate(random.sample(places, k=random.randint(3, len(places))))
        ]

    @property
    def brokers(self) -> list[BrokerProcess]:
        """All of them."""
        return self._brokers

    @contextmanager
    def limits(self) -> Iterator[None]:
        """Limits as in other worlds, and in half of the histories tiny slices of long work."""
        tiny = Random(f"{self.seed} slices").random() < 0.5
        with super().limits(), tiny_slices() if tiny else nullcontext():
            yield

    async def run(self) -> None:
        """Start everything, let it happen, heal."""
        for process in self._brokers:
            await process.start()
        await asyncio.sleep(self.random.choice([0.0, 1.0]))
        for member in self.members:
            member.start()
            await asyncio.sleep(0 if self.calm else self.random.random())
        end = self.loop.time() + CHAOS_SEC
        if self.calm:
            await _intrude(self, self.random.choice(self.members), 1.0)
        else:
            await asyncio.gather(self._suffer(OF_MEMBERS, end), self._suffer_in_mesh(end))
            self.heal()
            self.mesh.heal()
        await asyncio.sleep(max(0.0, end - self.loop.time()))
        self.record("quiet")
        self.active = False
        for member in self.members:
            await member.activities_end()
        await asyncio.sleep(SETTLE_SEC)
        self.mesh.unanswered = 0.0

    @property
    def backed_up(self) -> bool:
        """Whether a broker has more to send than its network takes."""
        return any(engine.backed_up for engine in self.mesh.engines)

    def live_from(self, pub: PublisherHistory, sub: SubscriptionHistory) -> int:
        """Return the number before which a latched publisher's messages came late to a reader's broker."""
        if pub.publisher.qos_profile.durability is not actors.DurabilityPolicy.TRANSIENT_LOCAL:
            return 0
        return self.mesh.live.get((self._place_of(sub), pub.publisher.gid), 0)

    def lost_between_brokers(self, pub: PublisherHistory, sub: SubscriptionHistory) -> set[int]:
        """Return the numbers of a publisher's messages that were lost before a subscription's broker."""
        place = self._place_of(sub)
        routers = [router for process in self._brokers for router in process.routers()]
        keys = {
            key
            for router in routers
            for key, record in router.routes.publishers.items()
            if record.gid == pub.publisher.gid
        }
        return {number for key in keys for number in self.mesh.lost.get((place, key), ())}

    def _place_of(self, sub: SubscriptionHistory) -> str:
        """Return the host of a subscription's broker."""
        url = endpoint_of(sub.subscription).context.link.url
        return next(process.host for process in self._brokers if process.url == url)

    async def _suffer_in_mesh(self, end: float) -> None:
        while self.loop.time() < end:
            await asyncio.sleep(self.random.expovariate(0.5))
            fault = self.random.choice(OF_THE_MESH)
            lasting = self.random.choice([0.01, 0.1, 1.0, 3.5, 8.0])
            self.record(f"fault {fault.__name__} {lasting}")
            self.journal.struck[fault.__name__] += 1
            await fault(self, lasting)
            self.mesh.heal()

    def two_brokers(self) -> tuple[BrokerProcess, BrokerProcess]:
        """Return two of them."""
        one, two = self.random.sample(self._brokers, k=2)
        return one, two

    def separate(self) -> list[BrokerProcess]:
        """Cut some brokers off the others, and return them."""
        some = self.random.sample(self._brokers, k=self.random.randint(1, len(self._brokers) - 1))
        for one in some:
            for two in self._brokers:
                if two not in some:
                    self.mesh.cut(one.host, two.host)
        return some


@contextmanager
def tiny_slices() -> Iterator[None]:
    """Let endpoints of other brokers come and go a few in a turn of the loop."""
    with (
        mock.patch.object(slices, "SLICE", 2),
        mock.patch.object(engine_member, "SHARE_FRAMES", 3),
        mock.patch.object(engine_member, "STEPS", 1),
    ):
        yield


# Faults of the mesh


async def lose_route(world: MeshWorld, lasting: float) -> None:
    """Lose what is on its way between two brokers, a few times if it is to last."""
    one, two = world.two_brokers()
    for _ in range(4 if lasting > 3 else 1):
        world.mesh.lose_route(one.host, two.host)
        await asyncio.sleep(0.2 * world.random.random())


async def cut(world: MeshWorld, lasting: float) -> None:
    """Separate two brokers, which both still reach the others."""
    one, two = world.two_brokers()
    world.mesh.cut(one.host, two.host)
    await asyncio.sleep(lasting)


async def separate(world: MeshWorld, lasting: float) -> None:
    """Separate some brokers from the others."""
    world.separate()
    await asyncio.sleep(lasting)


async def choke(world: MeshWorld, lasting: float) -> None:
    """Let a broker's engine send nothing for a while."""
    world.random.choice(world.mesh.engines).choke(min(lasting, 5.0))
    await asyncio.sleep(lasting)


async def crash(world: MeshWorld, lasting: float) -> None:
    """Kill a broker; another one follows at its address."""
    process = world.random.choice(world.brokers)
    await process.crash(silent=world.random.random() < 0.3)
    await asyncio.sleep(min(lasting, 8.0))
    world.heal()
    await process.start()


async def restart(world: MeshWorld, lasting: float) -> None:
    """End a broker in order; another one follows."""
    process = world.random.choice(world.brokers)
    await process.stop()
    await asyncio.sleep(min(lasting, 3.0))
    await process.start()


async def pretend(world: MeshWorld, lasting: float) -> None:
    """Announce brokers to one broker that are none: they never answer."""
    engine = world.random.choice(world.mesh.engines)
    numbers = [world.random.randrange(2**31, 2**32) for _ in range(world.random.choice([1, 20]))]
    for number in numbers:
        engine.hear_of(number)
    await asyncio.sleep(lasting)
    for number in numbers:
        engine.hear_of(number, alive=False)


async def flap(world: MeshWorld, lasting: float) -> None:
    """Let one broker see another one go and come again and again."""
    one, two = world.two_brokers()
    for _ in range(4):
        world.mesh.flap(one.host, two.host)
        await asyncio.sleep(min(lasting, 1.0) * world.random.random())


async def clash(world: MeshWorld, lasting: float) -> None:
    """Start a node with the name of one beyond a partition: both go on when that is over."""
    apart = world.separate()
    await asyncio.sleep(LEASE_SEC + 2.0)
    name = world.random.choice(world.members).name
    process = world.random.choice(apart)
    with on_host(f"{name}''"):
        twin = asyncio.create_task(_twin(world, name, process.url, lasting))
    await asyncio.sleep(1.0)
    world.mesh.heal()
    await twin


async def _twin(world: MeshWorld, name: str, url: str, lasting: float) -> None:
    node = actors.Node(name, url=url, connect_timeout_sec=2.0, use_global_arguments=False)
    try:
        async with node:
            await asyncio.sleep(1.0 + lasting)
    except actors.CallboardError as error:
        world.record(f"a twin of {name} ends: {error!r}")


async def _intrude(world: World, member: Member, lasting: float) -> None:
    """Start a process whose node has the name of another's, at any broker."""
    await faults.intrude(world, member, lasting, world.random.choice(world.brokers).url)


OF_THE_MESH: Final = (lose_route, cut, separate, choke, crash, restart, clash, pretend, flap)
OF_MEMBERS: tuple[Fault, ...] = (faults.drop, faults.kill, faults.stop, _intrude)
