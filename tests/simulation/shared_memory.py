"""Shared memory in histories: the same in each run, with limits that are reached, and empty at rest."""

from __future__ import annotations

from contextlib import contextmanager
from itertools import count
from random import Random
from typing import TYPE_CHECKING, Final
from unittest import mock

import actors.session.shared_memory
import broker.serving.shared_memory
from proto.aio.arena import Arena
from proto.wire.references import copy_payload
from tests.seams.brokers import dispatcher_of
from tests.seams.nodes import link_of
from tests.seams.simulation import arena_of, number_generations, shared_bytes_held

if TYPE_CHECKING:
    from collections.abc import Iterator

    from broker.serving.dispatcher import Dispatcher
    from proto.wire.frames import Reference
    from tests.simulation.world import World

MIB: Final = 1024 * 1024

ARENA_BYTES: Final = (MIB, 4 * MIB, 64 * MIB)
"""Sizes of arenas, of which each history has one."""

AHEAD_BYTES: Final = (1, MIB, 8 * MIB)
"""How much a broker refers to before a release, likewise."""


def read_copy(arena: Arena, reference: Reference) -> bytes | None:
    """Read as a reader in another process does."""
    return copy_payload(arena.memory, reference)


COPIES: Final = (False, True)
"""Whether nodes read arenas of this process as those of others, likewise."""


@contextmanager
def simulated_arenas(seed: int) -> Iterator[None]:
    """Announce the same numbers in each run; make arenas, and what may be read at once, small in some.

    In some all nodes read copies, as if each had a process of its own.
    """
    random, numbers, make = Random(f"{seed} arenas"), count(1), Arena.__init__

    def determined(arena: Arena, size: int) -> None:
        make(arena, size)
        number = next(numbers)
        number_generations(arena, number)
        arena.announcement = arena.announcement._replace(id=number, process=1, descriptor=number)

    arena_bytes, ahead_bytes = random.choice(ARENA_BYTES), random.choice(AHEAD_BYTES)
    read = read_copy if random.choice(COPIES) else Arena.read
    with (
        mock.patch.object(Arena, "__init__", determined),
        mock.patch.object(Arena, "read", read),
        mock.patch.object(actors.session.shared_memory, "ARENA_BYTES", arena_bytes),
        mock.patch.object(broker.serving.shared_memory, "AHEAD_BYTES", ahead_bytes),
    ):
        yield


def check_slots(world: World) -> None:
    """At rest all slots have come back, and nobody has more arenas than there are links.

    Where no links end early, no slot has been used again before it was read.
    """
    for member in world.members:
        shared = link_of(member.node).shared_memory
        if world.calm and shared.stale:
            world.complain(f"{member.host}: the slots of {shared.stale} messages were used again")
        if held := shared_bytes_held(shared):
            world.complain(f"{member.host}: the broker holds {held} shared bytes")
        arena = arena_of(shared)
        if arena is not None and arena.used_bytes:
            world.complain(f"{member.host}: {arena.used_bytes} bytes of its arena are in use at rest")
    for each in world.brokers:
        if each.alive and each.broker is not None:
            _check_broker(world, dispatcher_of(each.broker))


def _check_broker(world: World, dispatcher: Dispatcher) -> None:
    arenas = dispatcher.shared_memory.arenas
    if len(arenas) > len(dispatcher.links):
        world.complain(f"{len(arenas)} arenas of {len(dispatcher.links)} links")
    for opened in arenas.values():
        if opened.slots:
            world.complain(f"{opened.slots} slots of an arena are held at rest")
    for link in dispatcher.links:
        if link.memory is not None and link.memory.references.held_bytes:
            world.complain(f"{link} holds {link.memory.references.held_bytes} shared bytes at rest")
