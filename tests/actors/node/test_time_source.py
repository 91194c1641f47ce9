"""Simulated time: nodes follow `/clock` while `use_sim_time` is set."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

import pytest

import actors
from actors import ClockChange, ClockType, Duration, JumpThreshold, Parameter, Time
from actors.callbacks.functions import exit_ends_node
from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.testing import SimulatedClock
from tests.actors.meeting import DEADLINE_SEC, matched, turns, until
from tests.simulation.loop import simulate

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.meeting import Meeting
    from tests.simulation.loop import SimulatedLoop

SIMULATED: Final[dict[str, Any]] = {"parameter_overrides": {"use_sim_time": True}}
EVERY_JUMP: Final = JumpThreshold(
    min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1), on_clock_change=True
)


def at(seconds: float) -> Time:
    """Return a point of simulated time."""
    return Time(seconds=seconds, clock_type=ClockType.ROS_TIME)


async def simulated(meeting: Meeting, **options: Any) -> tuple[actors.Node, SimulatedClock]:
    """Start a node with simulated time, and what drives it."""
    node = await meeting.node("follower", **SIMULATED, **options)
    return node, SimulatedClock(await meeting.node("driver"), node)


def set_use_sim_time(node: actors.Node, value: bool) -> None:
    """Set the parameter."""
    (result,) = node.set_parameters([Parameter("use_sim_time", value=value)])
    assert result.successful


async def test_a_clock_follows_the_topic(meeting: Meeting) -> None:
    """The time is zero before the first message, then what was received last, forward and back."""
    node, clock = await simulated(meeting)
    assert node.get_clock().ros_time_is_active
    assert node.get_clock().now() == at(0)
    for seconds in (100.0, 100.1, 7.5, 1_700_000_000.123):
        await clock.set(seconds)
        assert node.get_clock().now() == at(seconds) == clock.now()


async def test_the_first_time_may_be_zero(meeting: Meeting) -> None:
    """The clock shows it before any message, but a step from there begins only when it has arrived."""
    node, clock = await simulated(meeting)
    timer = node.create_timer(60, lambda: None)
    await clock.set(0)
    await clock.advance(60)
    assert timer.ticks == 1


async def test_a_simulated_clock_reaches_nodes_that_follow_it_later(meeting: Meeting) -> None:
    """Each new subscription gets the time that stands still, however many others there are."""
    _, clock = await simulated(meeting)
    await clock.set(5)
    late = await meeting.node("late", **SIMULATED)
    await until(lambda: late.get_clock().now() == at(5))


async def test_goals_are_stamped_with_simulated_time(meeting: Meeting) -> None:
    """The stamp of a goal is the time of the server's node, as in rclpy."""
    node, clock = await simulated(meeting)

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        goal.succeed()
        return Fibonacci.Result()

    node.create_action_server(Fibonacci, "fibonacci", execute)
    client = (await meeting.node("client")).create_action_client(Fibonacci, "fibonacci")
    await clock.set(100.5)
    handle = await client.send_goal(Fibonacci.Goal())
    assert handle.stamp == at(100.5).to_msg()


async def test_by_default_there_is_no_subscription(meeting: Meeting) -> None:
    """Without use_sim_time the clock is the wall clock of ROS_TIME, and nothing subscribes to /clock."""
    node = await meeting.node("plain")
    assert node.get_clock().clock_type is ClockType.ROS_TIME
    assert not node.get_clock().ros_time_is_active
    assert node.get_clock().now() > at(1_600_000_000)
    assert node.diagnostics().subscriptions == ()


async def test_the_parameter_can_change_while_the_node_runs(meeting: Meeting) -> None:
    """Setting it subscribes and resetting it unsubscribes; jump callbacks see both, with the new time."""
    node = await meeting.node("follower")
    clock = SimulatedClock(await meeting.node("driver"), node)
    changes: list[tuple[ClockChange, bool]] = []

    def note(jump: actors.TimeJump) -> None:
        assert jump.delta == Duration()
        changes.append((jump.clock_change, node.get_clock().now() > at(1_600_000_000)))

    only_changes = JumpThreshold(min_forward=None, min_backward=None)
    node.get_clock().create_jump_callback(only_changes, post_callback=note)
    set_use_sim_time(node, True)
    set_use_sim_time(node, True)
    await clock.set(5)
    assert len(node.diagnostics().subscriptions) == 1
    set_use_sim_time(node, False)
    assert node.diagnostics().subscriptions == ()
    assert changes == [(ClockChange.ROS_TIME_ACTIVATED, False), (ClockChange.ROS_TIME_DEACTIVATED, True)]
    (refused,) = node.set_parameters([Parameter("use_sim_time", value=1)])
    assert not refused.successful


async def test_jump_callbacks_see_the_jumps_that_they_ask_for(meeting: Meeting) -> None:
    """Each threshold admits its jumps; the pre callback sees the old time; unregister ends the reports."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    own = node.get_clock()
    seen: list[tuple[str, float]] = []

    def register(name: str, forward: float | None, backward: float | None) -> actors.JumpHandle:
        threshold = JumpThreshold(
            min_forward=None if forward is None else Duration(seconds=forward),
            min_backward=None if backward is None else Duration(seconds=backward),
        )
        return own.create_jump_callback(
            threshold, post_callback=lambda jump: seen.append((name, jump.delta.nanoseconds / 1e9))
        )

    register("forward", 10, None)
    with register("back", None, -1):
        before: list[Time] = []
        handle = own.create_jump_callback(EVERY_JUMP, pre_callback=lambda: before.append(own.now()))
        for seconds in (105, 115, 114.5, 113.5):
            await clock.set(seconds)
    assert before == [at(100), at(105), at(115), at(114.5)]
    handle.unregister()
    await clock.set(50)
    assert seen == [("forward", 10.0), ("back", -1.0)]
    assert len(before) == 4


async def test_a_jump_callback_that_raises_is_counted(meeting: Meeting) -> None:
    """Its error is one of the node's callback errors; time and other callbacks go on."""
    node, clock = await simulated(meeting)

    def fail(_: object) -> None:
        raise ValueError("no")

    jumps: list[object] = []
    node.get_clock().create_jump_callback(EVERY_JUMP, post_callback=fail)
    node.get_clock().create_jump_callback(EVERY_JUMP, post_callback=jumps.append)
    await clock.set(1)
    await clock.set(2)
    assert len(jumps) == 2
    assert node.callback_errors == 2


async def test_an_exit_in_a_jump_callback_is_that_of_its_program(meeting: Meeting) -> None:
    """SystemExit ends the node of a program among others, as in every other callback."""
    driver = await meeting.node("driver")
    program = meeting.absent("program", **SIMULATED)
    clock = SimulatedClock(driver, program)

    def leave(_: object) -> None:
        raise SystemExit(3)

    program.get_clock().create_jump_callback(EVERY_JUMP, post_callback=leave)

    async def run() -> None:
        async with program:
            await clock.set(5)
            await asyncio.Event().wait()

    token = exit_ends_node.set(True)
    with pytest.raises(SystemExit) as caught:
        await run()
    exit_ends_node.reset(token)
    assert caught.value.code == 3


async def test_timers_tick_by_simulated_time(meeting: Meeting) -> None:
    """Ticks are exact at whole periods for any start, and TimerInfo has simulated times."""
    node, clock = await simulated(meeting)
    await clock.set(1_700_000_000)
    infos: list[actors.TimerInfo] = []
    timer = node.create_timer(0.1, infos.append)
    await clock.advance(0.05)
    assert timer.time_until_next_call() == 50_000_000
    assert infos == []
    await clock.advance(3.0, step=0.05)
    assert timer.ticks == 30
    assert timer.skipped == 0
    start = 1_700_000_000_000_000_000
    assert [info.expected_call_time - start for info in infos] == [n * 100_000_000 for n in range(1, 31)]
    assert all(info.expected_call_time == info.actual_call_time for info in infos)


async def test_a_long_step_is_one_tick(meeting: Meeting) -> None:
    """Missed periods are skipped and counted; the ticks after that keep their phase."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    times: list[Time] = []
    timer = node.create_timer(1, lambda: times.append(node.get_clock().now()))
    await clock.advance(3600.5)
    assert times == [at(3700.5)]
    assert timer.skipped == 3599
    await clock.advance(0.5)
    assert times == [at(3700.5), at(3701)]


async def test_a_step_back_delays_a_timer_by_one_period_at_most(meeting: Meeting) -> None:
    """After a long step back a timer ticks a period later; a step within the period keeps its time."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    timer = node.create_timer(1, lambda: None)
    await clock.advance(0.5)
    await clock.advance(-0.25)
    assert timer.time_until_next_call() == 750_000_000
    await clock.set(10)
    assert timer.time_until_next_call() == 1_000_000_000
    await clock.advance(5, step=0.5)
    assert timer.ticks == 5


async def test_a_timer_goes_on_when_the_source_of_time_changes(meeting: Meeting) -> None:
    """The rest of its period goes on by the new source, and the first time that arrives starts no burst."""
    node = await meeting.node("follower")
    clock = SimulatedClock(await meeting.node("driver"), node)
    timer = node.create_timer(1000, lambda: None)
    set_use_sim_time(node, True)
    left = timer.time_until_next_call()
    assert left is not None
    assert 900e9 < left <= 1000e9
    await clock.set(1_700_000_000)
    assert timer.ticks == 0
    assert timer.time_until_next_call() == 1000 * 10**9
    await clock.advance(400)
    set_use_sim_time(node, False)
    left = timer.time_until_next_call()
    assert left is not None
    assert 500e9 < left <= 600e9


def test_a_late_tick_is_as_late_by_the_new_source_of_time() -> None:
    """TimerInfo of a tick that waits for the mailbox while use_sim_time changes keeps how late it is."""
    infos: list[actors.TimerInfo] = []

    async def main(_: SimulatedLoop) -> None:
        async with actors.Node("clockwork", use_global_arguments=False) as node:

            async def hold() -> None:
                holding.cancel()
                await asyncio.sleep(0.25)
                set_use_sim_time(node, True)

            holding = node.create_timer(0.1, hold)
            node.create_timer(0.2, infos.append)
            await asyncio.sleep(1)

    simulate(main)
    (info,) = infos
    assert info.actual_call_time == 0
    assert info.expected_call_time == pytest.approx(-0.15e9)


async def test_a_timer_may_follow_another_clock(meeting: Meeting) -> None:
    """A timer of a steady clock ticks while simulated time stands still, as does one without a period."""
    node, _ = await simulated(meeting)
    steady = node.create_timer(0.001, lambda: None, clock=actors.Clock(ClockType.STEADY_TIME))
    idle = node.create_timer(0, lambda: None)
    own = node.create_timer(0.001, lambda: None)
    await until(lambda: steady.ticks > 3 and idle.ticks > 3)
    assert own.ticks == 0


async def test_cancelled_and_destroyed_timers_do_not_tick(meeting: Meeting) -> None:
    """By simulated time: cancel stops, reset starts a whole period, destroy ends it."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    timer = node.create_timer(1, lambda: None)
    timer.cancel()
    await clock.advance(5)
    assert timer.ticks == 0
    timer.reset()
    await clock.advance(0.5)
    assert timer.ticks == 0
    await clock.advance(0.5)
    assert timer.ticks == 1
    timer.destroy()
    await clock.advance(5)
    assert timer.ticks == 1


async def test_sleeps_end_by_simulated_time(meeting: Meeting) -> None:
    """They end when their time has come and not before, also in a callback that holds the mailbox."""
    node, clock = await simulated(meeting)
    ends: list[tuple[str, Time]] = []
    own = node.get_clock()

    async def sleep(name: str, sleep: Any) -> None:
        await sleep
        ends.append((name, own.now()))

    async def callback() -> None:
        timer.cancel()
        await sleep("callback", own.sleep_for(Duration(seconds=1)))

    await clock.set(100)
    timer = node.create_timer(1, callback)
    early = asyncio.ensure_future(sleep("for", own.sleep_for(0.1)))
    late = asyncio.ensure_future(sleep("until", own.sleep_until(at(101.5))))
    await turns()
    await clock.advance(0.05)
    await turns()
    assert ends == []
    for _ in range(20):
        await clock.advance(0.1)
        await turns()
    await asyncio.gather(early, late)
    assert [name for name, _ in ends] == ["for", "until", "callback"]
    assert [end.nanoseconds for _, end in ends] == [100_150_000_000, 101_550_000_000, 102_050_000_000]


async def test_a_sleep_before_the_first_time_begins_with_it(meeting: Meeting) -> None:
    """A duration is not measured from zero to the first time."""
    node, clock = await simulated(meeting)
    sleep = asyncio.ensure_future(node.get_clock().sleep_for(1))
    await turns()
    await clock.set(1000)
    await turns()
    await clock.advance(0.5)
    await turns()
    assert not sleep.done()
    await clock.advance(0.5)
    await sleep


@pytest.mark.parametrize("active", [True, False])
async def test_a_sleep_ends_with_an_error_when_the_source_changes(meeting: Meeting, active: bool) -> None:
    """TimeSourceChanged, in both directions."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    set_use_sim_time(node, active)
    own = node.get_clock()
    sleeps = [
        asyncio.ensure_future(own.sleep_for(1000)),
        asyncio.ensure_future(own.sleep_until(own.now() + Duration(seconds=1000))),
    ]
    await turns()
    set_use_sim_time(node, not active)
    for sleep in sleeps:
        with pytest.raises(actors.TimeSourceChanged):
            await sleep


@pytest.mark.parametrize(
    ("end", "error"),
    [
        (lambda node: set_use_sim_time(node, False), actors.TimeSourceChanged),
        (lambda node: node.get_clock().destroy(), actors.NodeDestroyed),
    ],
)
async def test_a_sleep_ends_when_a_jump_back_is_followed_by_the_end_of_its_time(
    meeting: Meeting, end: Callable[[actors.Node], None], error: type[BaseException]
) -> None:
    """The step back wakes a sleep to look at the time; what comes before it looks is not missed."""
    node, clock = await simulated(meeting)
    await clock.set(100)
    own = node.get_clock()
    sleeps = [asyncio.ensure_future(own.sleep_for(1000)), asyncio.ensure_future(own.sleep_until(at(1000)))]
    await turns()
    ended = asyncio.Event()

    def jumped(_: object) -> None:
        end(node)
        ended.set()

    back = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False)
    own.create_jump_callback(back, post_callback=jumped)
    step = asyncio.ensure_future(clock.set(50))
    await ended.wait()
    for sleep in sleeps:
        with pytest.raises(error):
            async with asyncio.timeout(DEADLINE_SEC):
                await sleep
    step.cancel()


async def test_a_callback_that_sleeps_may_end_while_the_node_stops(meeting: Meeting) -> None:
    """The clock goes on until callbacks have ended."""
    ended: list[Time] = []
    driver = await meeting.node("driver")
    node = meeting.absent("follower", **SIMULATED)
    begun = asyncio.Event()

    async def callback() -> None:
        begun.set()
        await node.get_clock().sleep_until(at(200))
        ended.append(node.get_clock().now())

    async with node:
        clock = SimulatedClock(driver, node)
        await clock.set(100)
        node.create_timer(1, callback)
        await clock.advance(1)
        await begun.wait()
        stop = asyncio.get_running_loop().create_task(clock.set(200))
    await stop
    assert ended == [at(200)]


async def test_a_negative_time_is_ignored(meeting: Meeting) -> None:
    """A message that no Time can hold changes nothing, and the next is taken."""
    node, clock = await simulated(meeting)
    await clock.set(5)
    other = await meeting.node("other")
    publisher = other.create_publisher(ClockMessage, "/clock", 1)
    await matched(publisher)
    publisher.publish(ClockMessage(clock=TimeMessage(sec=-1)))
    await meeting.settled(other, node)
    assert node.get_clock().now() == at(5)
    await clock.set(6)
    assert node.get_clock().now() == at(6)


async def test_time_goes_on_after_the_broker_was_restarted(meeting: Meeting) -> None:
    """The clock stands still without a broker, and follows again afterwards."""
    node, clock = await simulated(meeting)
    await clock.set(5)
    await meeting.restart_broker()
    assert node.get_clock().now() == at(5)
    await clock.set(6)
    assert node.get_clock().now() == at(6)
