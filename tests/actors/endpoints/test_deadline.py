"""A deadline: what it counts, and when it holds."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.endpoints.deadline import Deadline
from actors.time.types import Duration
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

SECOND = Duration(seconds=1)


class Counter:
    """Stands for the event: counts what is reported to it."""

    def __init__(self) -> None:
        self.total = 0

    def add(self, count: int) -> None:
        self.total += count


def played(scene: Callable[[Any, Counter], Coroutine[None, None, None]]) -> None:
    """Run `scene(core, counter)` on a virtual clock."""

    async def main(loop: SimulatedLoop) -> None:
        await scene(SimpleNamespace(link=SimpleNamespace(loop=loop)), Counter())

    simulate(main, 0)


def test_it_counts_each_period_without_a_message_from_its_beginning_to_its_end() -> None:
    """Nothing before it begins, nothing while it is met, nothing after it ends."""

    async def scene(context: Any, missed: Any) -> None:
        deadline = Deadline(context, SECOND, missed)
        await asyncio.sleep(3)
        deadline.begin()
        for _ in range(10):
            await asyncio.sleep(0.9)
            deadline.met()
        assert missed.total == 0
        await asyncio.sleep(2.5)
        assert missed.total == 2
        deadline.end()
        deadline.met()
        await asyncio.sleep(5)
        assert missed.total == 2

    played(scene)


def test_to_begin_again_is_no_message() -> None:
    """A second publisher that is matched does not make up for a message that is missing."""

    async def scene(context: Any, missed: Any) -> None:
        deadline = Deadline(context, SECOND, missed)
        for _ in range(5):
            deadline.begin()
            await asyncio.sleep(0.5)
        assert missed.total == 2
        deadline.end()

    played(scene)


def test_after_its_end_it_begins_with_a_whole_period() -> None:
    """Nobody was matched meanwhile: that time does not count."""

    async def scene(context: Any, missed: Any) -> None:
        deadline = Deadline(context, SECOND, missed)
        deadline.begin()
        await asyncio.sleep(0.5)
        deadline.end()
        await asyncio.sleep(10)
        deadline.begin()
        await asyncio.sleep(0.9)
        assert missed.total == 0
        await asyncio.sleep(0.2)
        assert missed.total == 1
        deadline.end()

    played(scene)


@pytest.mark.parametrize(("period", "running"), [(Duration(), True), (SECOND, False)])
def test_without_a_period_or_a_loop_there_is_nothing_to_watch(period: Duration, *, running: bool) -> None:
    """No deadline was asked for, or the node does not run."""

    async def scene(context: Any, missed: Any) -> None:
        context.link.loop = context.link.loop if running else None
        deadline = Deadline(context, period, missed)
        assert deadline.wanted is not running
        deadline.begin()
        deadline.met()
        await asyncio.sleep(5)
        assert missed.total == 0
        deadline.end()

    played(scene)
