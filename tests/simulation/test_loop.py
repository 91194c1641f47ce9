"""The simulated event loop: its clock and its end."""

from __future__ import annotations

import asyncio

import pytest

from tests.simulation.loop import SimulatedLoop, Stuck, simulate


def test_time_jumps_to_the_next_timer() -> None:
    """An hour of sleep takes no real time, and an hour of simulated time."""

    async def main(loop: SimulatedLoop) -> float:
        await asyncio.sleep(3600)
        return loop.time()

    assert simulate(main) == pytest.approx(3600)


def test_timers_come_in_order_of_their_time() -> None:
    """Timers fire in order of time, and at equal times in order of creation."""

    async def main(loop: SimulatedLoop) -> list[str]:
        seen: list[str] = []
        for name, when in [("late", 2.0), ("first", 1.0), ("second", 1.0)]:
            loop.call_at(when, seen.append, name)
        await asyncio.sleep(3)
        return seen

    assert simulate(main) == ["first", "second", "late"]


def test_a_program_that_waits_for_nothing_is_stuck() -> None:
    """A wait that cannot end raises instead of hanging."""

    async def main(loop: SimulatedLoop) -> None:
        await loop.create_future()

    with pytest.raises(Stuck, match="nothing can ever happen"):
        simulate(main)


def test_an_exception_in_a_callback_is_not_lost() -> None:
    """An exception that reaches the exception handler fails the simulation."""

    async def main(loop: SimulatedLoop) -> None:
        loop.call_soon(lambda: 1 // 0)
        await asyncio.sleep(1)

    with pytest.raises(ExceptionGroup) as caught:
        simulate(main)
    assert isinstance(caught.value.exceptions[0], ZeroDivisionError)


def test_a_stall_makes_timers_late() -> None:
    """After a freeze a process finds its timers overdue."""

    async def main(loop: SimulatedLoop) -> float:
        sleeper = asyncio.ensure_future(asyncio.sleep(1, result="woke"))
        await asyncio.sleep(0)
        loop.stall(10)
        await sleeper
        return loop.time()

    assert simulate(main) == pytest.approx(10)
