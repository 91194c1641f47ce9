"""The driver carries out a plan's steps in order, wakes the plan when it asks, and ends at an error."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from actors.processes.driver import Driver

if TYPE_CHECKING:
    from collections.abc import Sequence


class Countdown:
    """A plan that wants to be woken some times, and is finished then."""

    def __init__(self, ticks: int) -> None:
        self.left = ticks
        self.wake_at: float | None = None

    @property
    def finished(self) -> bool:
        """Whether it has been woken often enough."""
        return not self.left

    def begin(self, now: float) -> Sequence[str]:
        """Ask to be woken."""
        self.wake_at = now
        return ["begin"]

    def tick(self, now: float, /) -> Sequence[str]:
        """Count."""
        self.left -= 1
        self.wake_at = now + 0.001 if self.left else None
        return [f"left {self.left}"]


async def test_a_plan_is_woken_until_it_is_finished() -> None:
    """Each time that it asks for, and its steps are carried out in order."""
    plan, steps = Countdown(3), list[str]()
    driver = Driver(plan, steps.append)
    driver.begin(plan.begin)
    async with asyncio.timeout(30):
        assert not await driver.wait(lambda: None)
    assert steps == ["begin", "left 2", "left 1", "left 0"]
    assert driver.failure is None


async def test_steps_that_a_step_leads_to_come_after_it() -> None:
    """What a step makes happen is not carried out before the steps of the same transition."""
    plan, steps = Countdown(1), list[str]()

    def perform(step: str) -> None:
        steps.append(step)
        if step == "first":
            driver.happened(lambda _now: ["third"])

    driver = Driver(plan, perform)
    driver.begin(lambda _now: ["first", "second"])
    assert steps == ["first", "second", "third"]


@pytest.mark.parametrize("error", [OSError, SystemExit, GeneratorExit, pytest.fail.Exception])
async def test_an_error_ends_it(error: type[BaseException]) -> None:
    """Steps behind the failing one are dropped, and the error is kept for whoever runs it."""
    plan, steps = Countdown(1), list[str]()

    def perform(step: str) -> None:
        steps.append(step)
        raise error(step)

    driver = Driver(plan, perform)
    driver.begin(lambda _now: ["first", "second"])
    async with asyncio.timeout(30):
        assert not await driver.wait(lambda: None)
    assert steps == ["first"]
    assert isinstance(driver.failure, error)
