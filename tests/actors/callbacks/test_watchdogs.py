"""Watchdogs: one timer, however often they are fed, and no bark at food that lies in front of the door."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine


def played(scene: Callable[[SimulatedLoop], Coroutine[None, None, None]]) -> None:
    simulate(scene, 0)


def test_it_barks_for_each_hungry_period() -> None:
    """Fed in time it is quiet; then it barks at each period's end, until it is stopped."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[float] = []
        dog = Watchdog(loop, 1.0, lambda periods: expirations.append(round(loop.time() - start, 3)))
        await asyncio.sleep(5)
        start = loop.time()
        for _ in range(10):
            dog.reset()
            await asyncio.sleep(0.9)
        await asyncio.sleep(2.3)
        assert expirations == [9.1, 10.1, 11.1]
        dog.stop()
        await asyncio.sleep(5)
        assert len(expirations) == 3

    played(scene)


def test_once_is_once_until_it_is_fed() -> None:
    """A dog that barks once is quiet until it has been fed again."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[int] = []
        dog = Watchdog(loop, 1.0, expirations.append, once=True)
        dog.reset()
        await asyncio.sleep(5)
        assert expirations == [1]
        dog.reset()
        await asyncio.sleep(5)
        assert expirations == [1, 1]
        dog.stop()

    played(scene)


def test_after_a_stall_it_looks_twice() -> None:
    """What had come while the loop was busy counts; what really did not come, period by period."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[int] = []
        dog = Watchdog(loop, 1.0, expirations.append)
        dog.reset()
        loop.stall(3.5)
        loop.call_later(0.01, dog.reset)
        await asyncio.sleep(0.5)
        assert expirations == []
        loop.stall(3.0)
        await asyncio.sleep(0.2)
        assert expirations == [3]
        dog.stop()

    played(scene)


def test_who_was_stopped_watches_anew_when_fed() -> None:
    """Stopping a dog that was never fed does no harm, and hunger from before a stop does not count."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[float] = []
        dog = Watchdog(loop, 1.0, lambda periods: expirations.append(round(loop.time(), 3)))
        dog.stop()
        dog.reset()
        await asyncio.sleep(0.9)
        dog.stop()
        await asyncio.sleep(5.1)
        assert expirations == []
        dog.reset()
        await asyncio.sleep(1.5)
        assert expirations == [7.0]
        dog.stop()

    played(scene)
