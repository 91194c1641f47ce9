"""Simulated time while things break: nobody waits for ever, nobody is early, and time goes on afterwards."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

import pytest

import actors
from actors import ClockType, Duration, JumpThreshold, Parameter, Time
from actors.interfaces.rosgraph_msgs.msg import Clock
from tests.actors.meeting import BARE
from tests.simulation.network import BROKER, on_host
from tests.simulation.stage import Stage, play
from tests.simulation.world import determined

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    Fault = Callable[[Stage, "Driver", "Follower"], Coroutine[None, None, None]]

MS: Final = 1_000_000
START_SEC: Final = 100
PERIOD_SEC: Final = 0.1
STILL_SEC: Final = 6.0
"""How long time stands still, or a host is cut off: longer than the keepalive limit."""

BACK_SEC: Final = 30.0
"""Everybody is connected again, and has waited a few times, within this."""


class Driver:
    """Publishes `/clock` every 10 ms.

    Attributes:
        now: Simulated time in nanoseconds.
        paused: Whether it stands still.
    """

    def __init__(self, node: actors.Node, start_sec: float = START_SEC) -> None:
        self.node = node
        self.now = round(start_sec * 1e9)
        self.paused = False
        self._publisher = node.create_publisher(Clock, "/clock", 1)
        node.create_timer(0.01, self._publish)

    def _publish(self) -> None:
        self.now += 0 if self.paused else 10 * MS
        time = Time(nanoseconds=self.now, clock_type=ClockType.ROS_TIME)
        self._publisher.publish(Clock(clock=time.to_msg()))


class Follower:
    """A node with simulated time, a timer, and tasks that sleep again and again.

    Attributes:
        ticks: When its timer was due, and when it was called.
        waits: How often each task has slept.
        backward: Jumps back that the clock has reported.
        tasks: The tasks.
    """

    def __init__(self, node: actors.Node, host: str) -> None:
        self.node = node
        self.host = host
        self.clock = node.get_clock()
        self.ticks: list[actors.TimerInfo] = []
        self.timer = node.create_timer(PERIOD_SEC, self.ticks.append)
        self.rate = node.create_rate(1 / PERIOD_SEC)
        self.waits = {"sleep_for": 0, "sleep_until": 0, "rate": 0}
        self.backward: list[actors.TimeJump] = []
        back = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False)
        self.clock.create_jump_callback(back, post_callback=self.backward.append)
        with on_host(host):
            self.tasks = [
                asyncio.create_task(self._keep("sleep_for", self._sleep_for)),
                asyncio.create_task(self._keep("sleep_until", self._sleep_until)),
                asyncio.create_task(self._keep("rate", self.rate.sleep)),
            ]

    async def _keep(self, name: str, wait: Callable[[], Coroutine[None, None, None]]) -> None:
        while True:
            try:
                await wait()
            except actors.TimeSourceChanged:
                continue
            self.waits[name] += 1

    async def _sleep_for(self) -> None:
        began, jumps = self.clock.now(), len(self.backward)
        await self.clock.sleep_for(0.05)
        took = (self.clock.now() - began).nanoseconds
        assert took >= 50 * MS or began.nanoseconds == 0 or len(self.backward) > jumps

    async def _sleep_until(self) -> None:
        until = self.clock.now() + Duration(nanoseconds=70 * MS)
        await self.clock.sleep_until(until)
        assert self.clock.now() >= until

    @property
    def counts(self) -> list[int]:
        """How often everything that depends on its time has happened."""
        return [self.timer.ticks, *self.waits.values()]

    def went_on(self, since: list[int], times: int = 5) -> bool:
        """Tell whether everything has happened some times more."""
        assert not any(task.done() for task in self.tasks), self.tasks
        return all(now >= then + times for now, then in zip(self.counts, since, strict=True))


async def pause(stage: Stage, driver: Driver, _: Follower) -> None:
    """Simulated time stands still."""
    driver.paused = True
    await stands_still(stage, _)
    driver.paused = False


async def restart_broker(stage: Stage, _: Driver, follower: Follower) -> None:
    await stage.crash_broker()
    await stands_still(stage, follower)
    await stage.start_broker()


async def drop_driver(stage: Stage, _: Driver, __: Follower) -> None:
    stage.network.drop("driver")


async def drop_follower(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.network.drop(follower.host)


async def isolate_driver(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.network.partition("driver")
    await stands_still(stage, follower)


async def isolate_follower(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.network.partition(follower.host)
    await stands_still(stage, follower)


async def silence_follower(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.network.block(BROKER, follower.host)
    await stands_still(stage, follower)


async def freeze_follower(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.loop.freeze(follower.host)
    await stands_still(stage, follower)
    stage.loop.thaw(follower.host)


async def slow_follower(stage: Stage, _: Driver, follower: Follower) -> None:
    stage.network.slow_down(follower.host, read=100, pause=0.2)
    await asyncio.sleep(STILL_SEC)


async def wall_time_while_cut(stage: Stage, _: Driver, follower: Follower) -> None:
    """The node returns to the wall clock while it is cut off, and to simulated time afterwards."""
    stage.network.partition(follower.host)
    await asyncio.sleep(1)
    before = follower.counts
    assert all(result.successful for result in set_simulated(follower, simulated=False))
    await stage.until(lambda: follower.went_on(before), 5)
    assert all(result.successful for result in set_simulated(follower, simulated=True))


def set_simulated(follower: Follower, *, simulated: bool) -> list[actors.SetParametersResult]:
    return follower.node.set_parameters([Parameter("use_sim_time", value=simulated)])


async def stands_still(stage: Stage, follower: Follower) -> None:
    """Without new time nothing that depends on it happens."""
    await asyncio.sleep(1)
    since = follower.counts
    await asyncio.sleep(STILL_SEC - 1)
    assert follower.counts == since


async def enter_follower(stage: Stage, name: str) -> Follower:
    overrides = {**BARE["parameter_overrides"], "use_sim_time": True}
    return Follower(await stage.enter(name, parameter_overrides=overrides), name)


FAULTS: Final[tuple[Fault, ...]] = (
    pause,
    restart_broker,
    drop_driver,
    drop_follower,
    isolate_driver,
    isolate_follower,
    silence_follower,
    freeze_follower,
    slow_follower,
    wall_time_while_cut,
)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("fault", FAULTS)
def test_time_goes_on_after_a_fault(fault: Fault, seed: int) -> None:
    """Timers, rates and sleeps wait for the next time, and nodes with a whole link do not notice."""

    async def scene(stage: Stage) -> None:
        with determined(stage.loop, seed):  # the wall clock, too
            await live(stage)

    async def live(stage: Stage) -> None:
        follower, other = [await enter_follower(stage, name) for name in ("follower", "other")]
        driver = Driver(await stage.enter("driver"))
        for each in (follower, other):
            await stage.until(lambda: each.went_on([0] * 4), 5)  # noqa: B023 - awaited here
        since, began = other.counts, driver.now
        await fault(stage, driver, follower)
        passed = (driver.now - began) / 1e9
        if "follower" in fault.__name__ and passed > 1:
            assert other.went_on(since, round(passed / PERIOD_SEC) - 5)
        stage.network.heal()
        for each in (follower, other):
            since = each.counts
            await stage.until(lambda: each.went_on(since), BACK_SEC)  # noqa: B023 - awaited here
            assert 0 <= driver.now - each.clock.now().nanoseconds < 100 * MS
            if fault is not wall_time_while_cut:
                assert not each.backward
                check_ticks(each)
        await end(stage, follower, other)

    play(scene, seed)


def check_ticks(follower: Follower) -> None:
    """Check that all ticks were due at whole periods, none was early, and each missed one is counted."""
    due = [tick.expected_call_time for tick in follower.ticks]
    assert all(tick.expected_call_time <= tick.actual_call_time for tick in follower.ticks)
    assert all((when - due[0]) % (PERIOD_SEC * 1e9) == 0 for when in due)
    periods = (due[-1] - due[0]) // round(PERIOD_SEC * 1e9) + 1
    assert len(due) <= periods <= len(due) + follower.timer.skipped


async def end(stage: Stage, *followers: Follower) -> None:
    """Destroy the nodes: no task goes on to sleep."""
    for follower in followers:
        follower.node.destroy_node()
    await asyncio.sleep(0.01)
    assert all(
        isinstance(task.exception(), actors.NodeDestroyed) for each in followers for task in each.tasks
    )


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("step_sec", [-20.0, -5.0, -0.01, 0.0, 5.0])
@pytest.mark.parametrize("cut", ["", "driver", "follower", BROKER])
def test_another_simulation_may_follow(cut: str, step_sec: float, seed: int) -> None:
    """A driver dies, and its successor begins at another time: each node sees one jump; none waits longer.

    Timers and rates need a period at most after a step back, and sleeps reach their old deadline.
    """

    async def scene(stage: Stage) -> None:
        follower = await enter_follower(stage, "follower")
        driver = Driver(await stage.enter("driver"))
        await stage.until(lambda: follower.went_on([0] * 4), 5)
        stage.network.crash("driver")
        if cut == BROKER:
            await stage.crash_broker()
            await stands_still(stage, follower)
            await stage.start_broker()
        elif cut:
            stage.network.drop(cut)
        await asyncio.sleep(1)
        shown = follower.clock.now().nanoseconds
        since = follower.counts
        successor = Driver(await stage.enter("successor"), shown / 1e9 + step_sec)
        await stage.until(lambda: follower.clock.now().nanoseconds != shown, BACK_SEC, step=0.01)
        await stage.until(lambda: follower.timer.ticks >= since[0] + 5, 2 * PERIOD_SEC * 6, step=0.01)
        await stage.until(lambda: follower.waits["rate"] >= since[3] + 5, 2 * PERIOD_SEC * 6, step=0.01)
        await stage.until(lambda: follower.went_on(since), max(0.0, -step_sec) + 2, step=0.01)
        assert len(follower.backward) == (successor.now < driver.now and step_sec < -0.01)
        await end(stage, follower)

    play(scene, seed)
