"""A host that attacks the brokers of a history: frames with errors, floods, half frames, and no goodbye.

It publishes and serves under names of its own, and from the members it only reads: what they lose is the
broker's fault.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.wire import frames
from proto.wire.codec import encode
from tests.broker import frame_makers as make
from tests.simulation.member import SERVICES, TOPICS
from tests.simulation.network import MemoryTransport, on_host

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from tests.simulation.world import World

FLOOD: Final = 300
"""Frames of a flood: several shares of what a broker reads at once."""

FLOODS: Final[tuple[frames.Frame, ...]] = (
    frames.Ping(1),
    frames.Watch(1, keep=False),
    frames.Inspect(1),
    frames.Describe(make.HASH),
    frames.Undeclare(1),
    frames.Grant(1, 1, 2**63, 2**63),
    frames.Request(4, (frames.RequestEntry(1, None, None, b"q"),)),
)

DECLARED: Final[tuple[frames.Frame, ...]] = (
    make.publisher(1, "/hostile/a"),
    make.subscription(2, "/hostile/a", qos=make.KEEP_ALL),
    make.service(3, "/hostile/s"),
    make.client(4, "/hostile/s"),
    make.publisher(5, "/hostile/a", qos=make.LATCHED, next_sequence=2**63),
    frames.Watch(6, keep=True),
)

FAULTY: Final[tuple[frames.Frame, ...]] = (
    *DECLARED,
    make.batch(1, 0, 3),
    make.batch(2, 2**62),
    make.request(4, 1, 2),
    make.reply(3, 1),
    frames.Fragment(1, 1000, True, bytes(100)),
    frames.Credit(1, 5, 5),
    frames.Cancel(4, (1,)),
)
"""Frames in which bytes are changed."""


class _Link(asyncio.BufferedProtocol):
    """Reads, and forgets what it has read."""

    def __init__(self) -> None:
        self._buffer = bytearray(65_536)
        self.ended = asyncio.get_running_loop().create_future()

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result(None)


class StalledReader:
    """Subscribes to everything with KEEP_ALL, takes a few messages, and grants no more for a while.

    Args:
        world: The history.
        random: Chooses its windows, and when it grants again.
    """

    def __init__(self, world: World, random: Random) -> None:
        self._world = world
        self._random = random

    async def run(self) -> None:
        """Stall until somebody cancels it."""
        with on_host("stalled"):
            while True:
                await asyncio.sleep(self._random.random())
                address = self._world.home.url.removeprefix("callboard://")
                try:
                    transport, link = await self._world.network.connect(_Link, address)
                except OSError:
                    continue
                assert isinstance(link, _Link)
                try:
                    await self._read(transport, link)
                finally:
                    transport.abort()

    async def _read(self, transport: MemoryTransport, link: _Link) -> None:
        identity: frames.Options = {"instance": self._random.randbytes(16), "token": bytes(16)}
        transport.write(encode(frames.Hello(limits.PROTOCOL_VERSION, identity)))
        transport.write(encode(frames.Node(0, "/hostile/stalled")))
        for number, topic in enumerate(TOPICS, 1):
            window = self._random.choice([1, 5])
            declared = make.subscription(number, f"/{topic}", raw=True, qos=make.KEEP_ALL, window=window)
            transport.write(encode(declared))
        while not link.ended.done():
            await asyncio.wait({link.ended}, timeout=1.0)
            transport.write(encode(frames.Ping(1)))  # it is slow, not silent
            if self._random.random() < 0.1:
                self._world.journal.struck["stall_ends"] += 1
                for number in range(1, len(TOPICS) + 1):
                    transport.write(encode(frames.Grant(number, 1, 0, 0)))


class Attacker:
    """Connects again and again, each time for another attack.

    Args:
        world: The history; its end ends the attacks.
        name: The host.
        random: Chooses the attacks.
    """

    def __init__(self, world: World, name: str, random: Random) -> None:
        self._world = world
        self._name = name
        self._random = random
        self._attacks: tuple[Callable[[], bytes], ...] = (
            self._garbage,
            self._faulty,
            self._half,
            self._flood,
            self._deaf,
            self._churn,
        )

    async def run(self) -> None:
        """Attack until somebody cancels it."""
        with on_host(self._name):
            while True:
                await asyncio.sleep(self._random.expovariate(1.0))
                address = self._random.choice(self._world.brokers).url.removeprefix("callboard://")
                try:
                    transport, link = await self._world.network.connect(_Link, address)
                except OSError:
                    continue
                assert isinstance(link, _Link)
                try:
                    await self._attack(transport, link)
                finally:
                    transport.abort()

    async def _attack(self, transport: MemoryTransport, link: _Link) -> None:
        attack = self._random.choice(self._attacks)
        self._world.journal.struck[f"attack{attack.__name__}"] += 1
        if self._random.random() < 0.9:
            identity: frames.Options = {"instance": self._random.randbytes(16), "token": bytes(16)}
            transport.write(encode(frames.Hello(limits.PROTOCOL_VERSION, identity)))
            transport.write(encode(frames.Node(0, f"/hostile/{self._name}")))
        transport.write(attack())
        if self._random.random() < 0.3:
            transport.pause_reading()
        await asyncio.wait({link.ended}, timeout=self._random.choice([0.01, 0.5, 5.0]))

    def _garbage(self) -> bytes:
        return self._random.randbytes(self._random.choice([1, 10, 5000]))

    def _faulty(self) -> bytes:
        sent = [bytearray(encode(frame)) for frame in self._random.choices(FAULTY, k=8)]
        for raw in sent:
            for _ in range(self._random.randint(0, 3)):
                raw[self._random.randrange(len(raw))] = self._random.randrange(256)
        return b"".join(map(encode, DECLARED)) + b"".join(sent)

    def _half(self) -> bytes:
        raw = encode(make.publisher(1, "/hostile/a")) + encode(frames.Fragment(1, 2**20, True, bytes(9000)))
        return raw[: self._random.randrange(len(raw))]

    def _flood(self) -> bytes:
        return b"".join(map(encode, DECLARED)) + encode(self._random.choice(FLOODS)) * FLOOD

    def _deaf(self) -> bytes:
        return b"".join(
            encode(
                make.subscription(number, f"/{topic}", raw=True, qos={"depth": self._random.choice([1, 100])})
            )
            for number, topic in enumerate(TOPICS, 1)
        ) + b"".join(encode(make.client(number, f"/{name}")) for number, name in enumerate(SERVICES, 9))

    def _churn(self) -> bytes:
        both = encode(make.subscription(1, "/red", raw=True)) + encode(frames.Undeclare(1))
        return both * (FLOOD // 2)
