"""Watchdogs: one timer, however often they are reset, and no expiry while a reset may wait unread."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.callbacks.watchdogs import Watchdog
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine


def played(scene: Callable[[SimulatedLoop], Coroutine[None, None, None]]) -> None:
    simulate(scene, 0)


def test_it_expires_after_each_period_without_a_reset() -> None:
    """Reset in time it does not expire; then it expires at each period's end, until it is stopped."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[float] = []
        watchdog = Watchdog(loop, 1.0, lambda periods: expirations.append(round(loop.time() - start, 3)))
        await asyncio.sleep(5)
        start = loop.time()
        for _ in range(10):
            watchdog.reset()
            await asyncio.sleep(0.9)
        await asyncio.sleep(2.3)
        assert expirations == [9.1, 10.1, 11.1]
        watchdog.stop()
        await asyncio.sleep(5)
        assert len(expirations) == 3

    played(scene)


def test_once_is_once_until_it_is_fed() -> None:
    """With `once` it expires once, and again only after another reset."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[int] = []
        watchdog = Watchdog(loop, 1.0, expirations.append, once=True)
        watchdog.reset()
        await asyncio.sleep(5)
        assert expirations == [1]
        watchdog.reset()
        await asyncio.sleep(5)
        assert expirations == [1, 1]
        watchdog.stop()

    played(scene)


def test_after_a_stall_it_checks_twice() -> None:
    """What had come while the loop was busy counts; what really did not come, period by period."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[int] = []
        watchdog = Watchdog(loop, 1.0, expirations.append)
        watchdog.reset()
        loop.stall(3.5)
        loop.call_later(0.01, watchdog.reset)
        await asyncio.sleep(0.5)
        assert expirations == []
        loop.stall(3.0)
        await asyncio.sleep(0.2)
        assert expirations == [3]
        watchdog.stop()

    played(scene)


def test_who_was_stopped_watches_anew_when_fed() -> None:
    """Stopping a watchdog that was never reset does no harm, and time from before a stop does not count."""

    async def scene(loop: SimulatedLoop) -> None:
        expirations: list[float] = []
        watchdog = Watchdog(loop, 1.0, lambda periods: expirations.append(round(loop.time(), 3)))
        watchdog.stop()
        watchdog.reset()
        await asyncio.sleep(0.9)
        watchdog.stop()
        await asyncio.sleep(5.1)
        assert expirations == []
        watchdog.reset()
        await asyncio.sleep(1.5)
        assert expirations == [7.0]
        watchdog.stop()

    played(scene)
