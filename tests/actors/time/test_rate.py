"""Rates: ticks at whole periods of real time, on a virtual clock, and of simulated time."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import Duration
from actors.testing import SimulatedClock
from tests.actors.meeting import turns
from tests.simulation.loop import simulate

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tests.actors.meeting import Meeting
    from tests.simulation.loop import SimulatedLoop


def play(scene: Callable[[actors.Node, SimulatedLoop], Awaitable[None]]) -> None:
    """Run a scene with a node that has no broker, on a virtual clock."""

    async def main(loop: SimulatedLoop) -> None:
        async with actors.Node("clockwork", use_global_arguments=False) as node:
            await scene(node, loop)
        await asyncio.sleep(10)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    simulate(main)


@pytest.mark.parametrize(
    ("frequency", "error"),
    [(None, TypeError), ("1", TypeError), (0, ValueError), (-1, ValueError), (float("nan"), ValueError)],
)
def test_a_frequency_is_a_number_above_zero(frequency: Any, error: type[Exception]) -> None:
    """Something else is a TypeError, zero and less a ValueError."""
    with pytest.raises(error, match="frequency"):
        actors.Node("clockwork", use_global_arguments=False).create_rate(frequency)


def test_ticks_come_at_whole_periods() -> None:
    """Work between two sleeps does not delay the next tick; ticks that pass during it are skipped."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        start, times = loop.time(), list[float]()
        rate = node.create_rate(10)
        for work in (0.03, 0.0, 0.25, 0.05):
            await asyncio.sleep(work)
            await rate.sleep()
            times.append(loop.time() - start)
        assert times == pytest.approx([0.1, 0.2, 0.5, 0.6])

    play(scene)


def test_a_rate_made_without_a_loop_starts_with_the_first_sleep() -> None:
    """Nodes may make it in their constructor."""
    rate = actors.Rate(10, actors.Clock())

    async def main(loop: SimulatedLoop) -> None:
        await asyncio.sleep(0.05)
        await rate.sleep()
        assert loop.time() == pytest.approx(0.15)

    simulate(main)


def test_destroying_a_rate_wakes_its_sleepers() -> None:
    """All sleeps return at once, and further ones are refused."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        rate = node.create_rate(0.01)
        start = loop.time()
        sleepers = [asyncio.ensure_future(rate.sleep()) for _ in range(2)]
        await asyncio.sleep(1)
        assert node.destroy_rate(rate)
        await asyncio.gather(*sleepers)
        assert loop.time() - start == pytest.approx(1)
        with pytest.raises(RuntimeError, match="destroyed rate"):
            await rate.sleep()

    play(scene)


def test_a_sleep_ends_with_its_node() -> None:
    """It raises NodeDestroyed."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        sleeper = asyncio.ensure_future(node.create_rate(0.01).sleep())
        await asyncio.sleep(1)
        node.destroy_node()
        await asyncio.wait([sleeper], timeout=1)
        assert isinstance(sleeper.exception(), actors.NodeDestroyed)

    play(scene)


async def test_a_rate_follows_simulated_time(meeting: Meeting) -> None:
    """It starts anew with the first time, after a step back, and when the source of time changes."""
    node = await meeting.node("follower", parameter_overrides={"use_sim_time": True})
    clock = SimulatedClock(await meeting.node("driver"), node)
    rate, ticks = node.create_rate(1), list[float]()

    async def loop() -> None:
        while True:
            await rate.sleep()
            ticks.append(node.get_clock().now().nanoseconds / 1e9)

    task = asyncio.ensure_future(loop())
    await turns()
    for seconds in (100, 100.5, 101, 101.9, 102, 107.25, 107.75, 108, 50, 50.5, 51, 52):
        await clock.set(seconds)
        await turns()
    assert ticks == [101, 102, 107.25, 108, 51, 52]
    use = actors.Parameter("use_sim_time", value=False)
    node.set_parameters([use])
    await turns()
    assert not task.done()
    task.cancel()
    await asyncio.wait([task])
    assert len(ticks) == 6


async def test_all_sleepers_of_a_rate_follow_another_source_of_time(meeting: Meeting) -> None:
    """When use_sim_time changes, each waits for a tick of the new source, not only the first that wakes."""
    node = await meeting.node("follower", parameter_overrides={"use_sim_time": True})
    await SimulatedClock(await meeting.node("driver"), node).set(100)
    rate = node.create_rate(1 / 1000)
    sleepers = [asyncio.ensure_future(rate.sleep()) for _ in range(2)]
    await turns()
    node.set_parameters([actors.Parameter("use_sim_time", value=False)])
    await turns()
    assert not any(sleeper.done() for sleeper in sleepers)
    rate.destroy()
    await asyncio.gather(*sleepers)


async def test_lifespans_are_measured_in_simulated_time(meeting: Meeting) -> None:
    """Messages that wait do not expire while time stands still, and expire when it is advanced."""
    from actors.interfaces.std_msgs.msg import Int64  # noqa: PLC0415 - only here

    node = await meeting.node("follower", parameter_overrides={"use_sim_time": True})
    driver = await meeting.node("driver")
    clock = SimulatedClock(driver, node)
    lasting = actors.QoSProfile(depth=10, lifespan=Duration(nanoseconds=1_000_000))
    publisher = driver.create_publisher(Int64, "/number", lasting)
    subscription = node.create_subscription(Int64, "/number", qos_profile=10)
    await meeting.settled(driver, node)

    async def send(number: int) -> None:
        publisher.publish(Int64(data=number))
        await meeting.settled(driver, node)

    await send(1)
    await clock.set(1_700_000_000)  # the first time is no step forward
    async with asyncio.timeout(10):
        assert (await anext(aiter(subscription))).data == 1
    await send(2)
    await clock.set(1_000_000_000)
    async with asyncio.timeout(10):
        assert (await anext(aiter(subscription))).data == 2
    await send(3)
    await clock.advance(0.002)
    await send(4)
    async with asyncio.timeout(10):
        assert (await anext(aiter(subscription))).data == 4
    assert subscription.expired == 1
    node.set_parameters([actors.Parameter("use_sim_time", value=False)])
    await send(5)
    node.set_parameters([actors.Parameter("use_sim_time", value=True)])
    await send(6)
    await clock.advance(0.002)
    await send(7)
    async with asyncio.timeout(10):
        assert (await anext(aiter(subscription))).data == 7
    assert subscription.expired == 3
