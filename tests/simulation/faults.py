"""The faults of a world. The caller starts each fault and, if it lasts, heals it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from tests.simulation.network import BROKER, on_host
from tests.simulation.presence import silence

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tests.simulation.member import Member
    from tests.simulation.world import World

    Fault = Callable[[World, Member, float], Awaitable[None]]


async def drop(world: World, member: Member, lasting: float) -> None:
    """Break the member's connection, a few times if it is to last."""
    for _ in range(4 if lasting > 3 else 1):
        world.network.drop(member.host)
        await asyncio.sleep(0.2 * world.random.random())


async def half_open(world: World, member: Member, lasting: float) -> None:
    """Lose everything in one direction."""
    ends = [member.host, BROKER]
    world.random.shuffle(ends)
    world.network.block(*ends)
    mute = ends[0] == member.host
    await silence(
        world, lasting, cannot_send=[member] if mute else [], cannot_receive=[] if mute else [member]
    )


async def partition(world: World, member: Member, lasting: float) -> None:
    """Cut the member's cable."""
    world.network.partition(member.host)
    await silence(world, lasting, cannot_send=[member], cannot_receive=[member])


async def slow(world: World, member: Member, lasting: float) -> None:
    """Slow down the reads of the member or the broker."""
    host = world.random.choice([member.host, member.host, BROKER])
    read, pause = world.random.choice([50, 1000]), world.random.choice([0.05, 0.3])
    world.network.slow_down(host, read=read, pause=pause)
    await asyncio.sleep(lasting)


async def kill(world: World, member: Member, lasting: float) -> None:
    """Kill the member's process; another one follows."""
    silent = world.random.random() < 0.3
    await member.kill(silent=silent)
    # The broker cannot know that a process without a sign is dead: its name is taken until the link closes.
    await asyncio.sleep(40 if silent else lasting)
    member.start()


async def stop(world: World, member: Member, lasting: float) -> None:
    """End the member's process in order; another one follows."""
    await member.stop()
    await asyncio.sleep(min(lasting, 1.0))
    member.start()


async def freeze(world: World, member: Member, lasting: float) -> None:
    """Freeze a process like SIGSTOP: its kernel accepts bytes, and they are not read."""
    host = world.random.choice([member.host, member.host, BROKER])
    world.freeze(host)
    if host == BROKER:
        await silence(world, lasting, cannot_send=[], cannot_receive=world.members)
    else:
        await silence(world, lasting, cannot_send=[member], cannot_receive=[])
    world.thaw(host)


async def intrude(world: World, member: Member, lasting: float, url: str = "") -> None:
    """Start a process whose node has the name of another's."""
    outcomes: list[str] = []

    async def twin() -> None:
        node = actors.Node(
            member.name, url=url or member.url, connect_timeout_sec=2.0, use_global_arguments=False
        )
        try:
            async with node:
                await asyncio.sleep(min(lasting, 1.0))
        except actors.CallboardError as error:
            outcomes.append(type(error).__name__)

    await _connected(world, member)
    with on_host(f"{member.host}'"):
        await asyncio.create_task(twin())
    if world.calm and outcomes != ["NodeNameTaken"]:
        world.complain(f"a second node called {member.name} was met with {outcomes}")


async def usurp(world: World, member: Member, lasting: float) -> None:
    """Start a process with the name of a frozen one, which is suspended if another node depends on it."""
    world.freeze(member.host)
    await asyncio.sleep(world.random.choice([5.0, 12.0]))  # while it keeps its name, or after that
    await intrude(world, member, lasting)
    world.thaw(member.host)


async def _connected(world: World, member: Member) -> None:
    """Wait until the member has its name, in a calm history."""
    while world.calm and not member.node.connected:
        await asyncio.sleep(0.1)
    await asyncio.sleep(1.0)


async def crash_broker(world: World, member: Member, lasting: float) -> None:
    """Kill the broker; another one follows at the same address."""
    await world.home.crash(silent=world.random.random() < 0.3)
    await asyncio.sleep(min(lasting, 8.0))
    world.heal()
    await world.home.start()


async def restart_broker(world: World, member: Member, lasting: float) -> None:
    """End the broker in order; another one follows."""
    await world.home.stop()
    await asyncio.sleep(min(lasting, 3.0))
    await world.home.start()


async def stall(world: World, member: Member, lasting: float) -> None:
    """Freeze all processes."""
    world.stall(min(lasting, 8.0))


OF_THE_NETWORK: tuple[Fault, ...] = (drop, half_open, partition, slow, stall, freeze)
OF_PROCESSES: tuple[Fault, ...] = (kill, stop, crash_broker, restart_broker, intrude)
"""Two kinds, because two of one kind at the same time make no sense, and one of each does. `usurp` is for
histories that want nothing else (`breakages.py`)."""


async def strike(world: World, faults: tuple[Fault, ...]) -> None:
    """Start one fault, and heal it."""
    fault = world.random.choice(faults)
    member = world.random.choice(world.members)
    lasting = world.random.choice([0.1, 1.0, 2.9, 3.5, 8.0, 35.0])
    world.record(f"fault {fault.__name__} {member.host} {lasting}")
    world.journal.struck[fault.__name__] += 1
    await fault(world, member, lasting)
    world.heal()
