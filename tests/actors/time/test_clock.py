"""Time, Duration and Clock: arithmetic to the nanosecond, and sleeping in virtual time."""

from __future__ import annotations

import asyncio
import math
import operator
import selectors
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.errors import NodeDestroyed
from actors.time.clock import Clock
from actors.time.types import INFINITE, ClockType, Duration, Time
from tests.seams.nodes import sleepers

if TYPE_CHECKING:
    from collections.abc import Coroutine

NANOSECONDS = st.integers(0, (1 << 62) - 1)


@dataclass
class Stamp:
    """The shape of a builtin_interfaces Time or Duration."""

    sec: int
    nanosec: int


class VirtualLoop(asyncio.SelectorEventLoop):
    """A loop whose clock jumps to the next timer instead of waiting."""

    def __init__(self) -> None:
        self.now = 100.0
        loop = self

        class Selector(selectors.SelectSelector):
            def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
                loop.now += timeout or 0.0
                return super().select(0)

        super().__init__(Selector())

    def time(self) -> float:
        return self.now


def run_virtually(main: Coroutine[Any, Any, object]) -> float:
    """Run to the end and return the virtual seconds that it took."""
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        loop = runner.get_loop()
        start = loop.time()
        runner.run(main)
        return loop.time() - start


def test_duration_counts_nanoseconds() -> None:
    """Seconds and nanoseconds add up; floats are rounded, ints are exact."""
    assert Duration(seconds=1, nanoseconds=5).nanoseconds == 1_000_000_005
    assert Duration(seconds=1.001).nanoseconds == 1_001_000_000
    assert Duration(seconds=9_223_372_035, nanoseconds=1).nanoseconds == 9_223_372_035_000_000_001
    assert Duration(seconds=-1).nanoseconds == -1_000_000_000


def test_duration_text() -> None:
    """The longest duration is Infinite, others tell their nanoseconds."""
    assert str(INFINITE) == "Infinite"
    assert str(Duration(nanoseconds=7)) == "7 nanoseconds"
    assert repr(Duration(nanoseconds=7)) == "Duration(nanoseconds=7)"


def test_duration_arithmetic() -> None:
    """Durations add, subtract, negate, compare and hash by value."""
    one, two = Duration(seconds=1), Duration(seconds=2)
    assert one + one == two
    assert one - two == -one
    assert one < two
    assert two >= one
    assert len({one, Duration(nanoseconds=10**9)}) == 1
    assert one != 1_000_000_000


@pytest.mark.parametrize("kind", [Duration, Time])
def test_limits(kind: type[Duration | Time]) -> None:
    """What does not fit into 64 bits is an OverflowError, what is not finite a ValueError."""
    for nanoseconds in (1 << 63, 1e30):
        with pytest.raises(OverflowError, match="64 bits"):
            kind(nanoseconds=nanoseconds)
    for seconds in (math.inf, math.nan):
        with pytest.raises(ValueError, match="must be finite"):
            kind(seconds=seconds)


def test_time_is_not_negative() -> None:
    """A point in time before the clock's zero is a ValueError."""
    with pytest.raises(ValueError, match="Seconds value must not be negative"):
        Time(seconds=-1)
    with pytest.raises(ValueError, match="Nanoseconds value must not be negative"):
        Time(nanoseconds=-1)
    with pytest.raises(ValueError, match="must not be negative"):
        _ = Time(seconds=1) - Duration(seconds=2)


def test_time_arithmetic() -> None:
    """Points and spans combine as they should and keep the kind of clock."""
    point = Time(seconds=5, nanoseconds=7, clock_type=ClockType.ROS_TIME)
    assert point.seconds_nanoseconds() == (5, 7)
    assert point + Duration(nanoseconds=3) == Time(nanoseconds=5_000_000_010, clock_type=ClockType.ROS_TIME)
    assert Duration(nanoseconds=3) + point == point + Duration(nanoseconds=3)
    assert (point - Duration(seconds=5)).nanoseconds == 7
    assert point - Time(seconds=6, clock_type=ClockType.ROS_TIME) == Duration(nanoseconds=-999_999_993)
    assert point < point + Duration(nanoseconds=1)
    assert repr(point) == "Time(nanoseconds=5000000007, clock_type=ROS_TIME)"


def test_different_clocks_do_not_compare() -> None:
    """Points of different clocks are unequal; ordering or subtracting them is a TypeError."""
    system, steady = Time(seconds=1), Time(seconds=1, clock_type=ClockType.STEADY_TIME)
    assert system != steady
    assert len({system, steady}) == 2
    for compare in (operator.lt, operator.ge, operator.sub):
        with pytest.raises(TypeError, match="different clock types: SYSTEM_TIME and STEADY_TIME"):
            compare(system, steady)


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.lt])
@pytest.mark.parametrize("value", [Time(seconds=1), Duration(seconds=1)])
def test_numbers_are_no_durations(operation: Any, value: Time | Duration) -> None:
    """A bare number has no unit, so it does not combine."""
    with pytest.raises(TypeError):
        operation(value, 1)


@given(NANOSECONDS, st.integers(-(1 << 62), 1 << 62))
def test_adding_and_subtracting_are_inverse(start: int, span: int) -> None:
    """(t + d) - t is d, wherever the sum exists."""
    point, duration = Time(nanoseconds=start), Duration(nanoseconds=span)
    if start + span >= 0:
        assert (point + duration) - point == duration


def test_time_from_message() -> None:
    """A message's seconds and nanoseconds become a point of ROS time, and a duration."""
    message = Stamp(sec=12, nanosec=34)
    assert Time.from_msg(message) == Time(seconds=12, nanoseconds=34, clock_type=ClockType.ROS_TIME)
    assert Time.from_msg(message, ClockType.STEADY_TIME).clock_type is ClockType.STEADY_TIME
    assert Duration.from_msg(Stamp(sec=-1, nanosec=5)) == Duration(nanoseconds=-999_999_995)


@given(st.integers(0, (1 << 31) * 10**9 - 1))
def test_messages_round_trip(nanoseconds: int) -> None:
    """What goes into a builtin_interfaces message comes out of it."""
    point = Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
    assert Time.from_msg(point.to_msg()) == point
    span = Duration(nanoseconds=-nanoseconds)
    assert Duration.from_msg(span.to_msg()) == span


def test_now_reads_the_wall_clock_or_the_steady_one() -> None:
    """The default is the wall clock; STEADY_TIME is the monotonic one."""
    before = time.time_ns()
    assert before <= Clock().now().nanoseconds <= time.time_ns()
    before = time.monotonic_ns()
    now = Clock(ClockType.STEADY_TIME).now()
    assert before <= now.nanoseconds <= time.monotonic_ns()
    assert now.clock_type is ClockType.STEADY_TIME
    assert Clock(source=lambda: 42).now() == Time(nanoseconds=42)
    assert repr(Clock()) == "Clock(clock_type=SYSTEM_TIME)"


@pytest.mark.parametrize("duration", [0, -1, -math.inf, Duration(seconds=0), Duration(seconds=-5)])
def test_sleeping_not_at_all(duration: Duration | float) -> None:
    """Zero and negative durations return at once."""
    assert run_virtually(Clock().sleep_for(duration)) == 0


@pytest.mark.parametrize("duration", [2.5, Duration(seconds=2.5)])
def test_sleeping(duration: Duration | float) -> None:
    """A sleep lasts as long as it should, given in seconds or as a Duration."""
    assert run_virtually(Clock().sleep(duration)) == pytest.approx(2.5)


def test_very_long_sleep() -> None:
    """A sleep longer than a loop's timers can reach is taken in turns."""
    assert run_virtually(Clock().sleep_for(1e6)) == pytest.approx(1e6)


def test_nan_sleep() -> None:
    """A sleep of nan is a ValueError, not an endless one."""
    with pytest.raises(ValueError, match="not nan"):
        run_virtually(Clock().sleep_for(math.nan))


def test_concurrent_sleeps() -> None:
    """Three sleeps end in order, none early, all within the longest."""
    ended: list[float] = []
    clock = Clock()

    async def sleep(seconds: float) -> None:
        start = asyncio.get_running_loop().time()
        await clock.sleep_for(seconds)
        ended.append(asyncio.get_running_loop().time() - start)

    async def main() -> None:
        await asyncio.gather(sleep(0.2), sleep(0.05), sleep(0.1))

    assert run_virtually(main()) == pytest.approx(0.2)
    assert ended == sorted(ended)
    assert all(got >= wanted - 1e-9 for got, wanted in zip(ended, (0.05, 0.1, 0.2), strict=True))


def test_sleep_until() -> None:
    """Sleeping until a point waits for this clock to show it; the past returns at once."""

    async def main() -> None:
        loop = asyncio.get_running_loop()
        clock = Clock(source=lambda: round(loop.time() * 1e9))
        await clock.sleep_until(clock.now() - Duration(seconds=1))
        await clock.sleep_until(clock.now() + Duration(seconds=3))

    assert run_virtually(main()) == pytest.approx(3.0)


def test_sleep_until_notices_that_the_clock_was_set() -> None:
    """A wall clock that is put forward ends the sleep within a second."""

    async def main() -> None:
        readings = iter([0, 3_600_000_000_000])
        await Clock(source=lambda: next(readings)).sleep_until(Time(seconds=3600))

    assert run_virtually(main()) == pytest.approx(1.0)


def test_sleep_until_another_clock() -> None:
    """A point of another kind of clock is a ValueError."""
    with pytest.raises(ValueError, match="clock type does not match"):
        run_virtually(Clock().sleep_until(Time(seconds=1, clock_type=ClockType.STEADY_TIME)))


def test_destroyed_clock() -> None:
    """Destroying a clock ends its sleeps with NodeDestroyed, as later ones; reading still works."""

    async def main() -> None:
        clock = Clock()
        sleep = asyncio.ensure_future(clock.sleep_for(100))
        until = asyncio.ensure_future(clock.sleep_until(clock.now() + Duration(seconds=100)))
        await asyncio.sleep(0)
        clock.destroy()
        clock.destroy()
        results = await asyncio.gather(sleep, until, return_exceptions=True)
        assert [type(result) for result in results] == [NodeDestroyed] * 2
        for call in (clock.sleep_for(1), clock.sleep_until(clock.now())):
            with pytest.raises(NodeDestroyed):
                await call

    assert run_virtually(main()) == 0


def test_cancelling_a_sleep_leaves_nothing() -> None:
    """A cancelled sleep leaves no timer in the loop and no entry in the clock."""

    async def main() -> None:
        clock = Clock()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1):
                await clock.sleep_for(100)
        assert sleepers(clock) == 0

    assert run_virtually(main()) == pytest.approx(1.0)


def test_durations_are_multiplied() -> None:
    """Whole factors are exact, fractions are rounded, and infinity gives the infinite duration."""
    duration = Duration(nanoseconds=(1 << 60) + 1)
    assert (duration * 2).nanoseconds == (1 << 61) + 2
    assert 0.5 * Duration(seconds=3) == Duration(seconds=1.5)
    assert Duration(seconds=1) * float("inf") == INFINITE
    with pytest.raises(ValueError, match="finite"):
        Duration(seconds=1) * float("nan")
    with pytest.raises(TypeError):
        Duration(seconds=1) * "2"  # type: ignore[operator]
