"""Waking the event loop when a message is due."""

from __future__ import annotations

import asyncio
import time

from actors.bags.player.alarm import EXACT_NS, Alarm
from tests.actors.meeting import until

MS = 1_000_000


async def test_it_rings_after_the_wait() -> None:
    """A short wait is the thread's, a long one the loop's, which rings early, to be set again."""
    rung = asyncio.Event()
    alarm = Alarm(rung.set)
    for wait_ns in (3 * MS, EXACT_NS + 2 * MS):
        rung.clear()
        began = time.monotonic_ns()
        alarm.set(wait_ns)
        await rung.wait()
        assert time.monotonic_ns() - began >= (wait_ns - EXACT_NS if wait_ns > EXACT_NS else wait_ns - MS)
    alarm.close()


async def test_it_can_be_cancelled_and_set_again() -> None:
    """Of long waits, the last one counts."""
    rung: list[int] = []
    alarm = Alarm(lambda: rung.append(time.monotonic_ns()))
    alarm.set(3600 * 1000 * MS)
    alarm.cancel()
    alarm.set(3600 * 1000 * MS)
    alarm.set(1 * MS)
    await until(lambda: bool(rung))
    alarm.set(3600 * 1000 * MS)
    alarm.close()
    assert len(rung) == 1


def test_a_loop_that_has_ended_is_no_error() -> None:
    """The thread ends by itself."""

    async def leave() -> Alarm:
        alarm = Alarm(lambda: None)
        alarm.set(2 * MS)
        return alarm

    alarm = asyncio.run(leave())
    alarm.close()
