"""When the messages of a bag are due, by a clock that the test sets."""

from __future__ import annotations

import random

import pytest

from actors.bags.errors import InvalidBagOptionError
from actors.bags.player.schedule import Schedule
from actors.time.types import NANOSECONDS_PER_SECOND

START_NS = 1_700_000_000_000_000_000
SEC = NANOSECONDS_PER_SECOND


def schedule(length_sec: float = 100, **options: object) -> Schedule:
    """Return a schedule of a bag of some seconds, started at 0."""
    return Schedule(START_NS, START_NS + round(length_sec * SEC), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("rate", [1.0, 0.3, 2.7])
def test_an_hour_has_no_drift(rate: float) -> None:
    """However late the loop wakes up, each message is due at its own time, to the nanosecond."""
    late = random.Random(1)
    plan = schedule(3600, rate=rate)
    now_ns = 0
    for index in range(36_000):
        time_ns = START_NS + index * SEC // 10
        now_ns += plan.wait_ns(time_ns, now_ns) or 0
        ideal_ns = (time_ns - START_NS) / rate
        assert -1 <= now_ns - ideal_ns <= 5_000_001
        plan.played(time_ns)
        now_ns += late.randrange(5_000_000)
    assert plan.wait_ns(START_NS + 3600 * SEC, 0) == pytest.approx(3600 * SEC / rate, abs=1)


def test_pauses_and_rates_do_not_add_up() -> None:
    """A thousand pauses and changes of the rate move a message by less than a microsecond."""
    plan = schedule(1000)
    now_ns = 0
    for _ in range(1000):
        now_ns += SEC // 4
        plan.set_rate(2, now_ns)
        now_ns += SEC // 8
        plan.set_rate(1, now_ns)
        plan.pause(now_ns)
        now_ns += 7 * SEC
        plan.resume(now_ns)
    assert plan.position_ns(now_ns) == pytest.approx(START_NS + 500 * SEC, abs=1000)
    assert plan.wait_ns(START_NS + 501 * SEC, now_ns) == pytest.approx(SEC, abs=1000)


def test_a_duration_of_zero_is_no_time() -> None:
    """As in ROS 2: not even the first message; with a time to stop at, that counts."""
    assert schedule(duration_ns=0).is_empty
    assert schedule(duration_ns=0, until_ns=0).is_empty
    assert schedule(start_offset_ns=200 * SEC).is_empty
    assert not schedule(duration_ns=1).is_empty
    assert not schedule(duration_ns=0, until_ns=START_NS).is_empty


def test_nothing_is_due_while_paused() -> None:
    """The time of the bag stops, and continues from there."""
    plan = schedule(is_paused=True)
    assert plan.wait_ns(START_NS, 5) is None
    assert plan.position_ns(10 * SEC) == START_NS
    plan.resume(10 * SEC)
    assert plan.wait_ns(START_NS, 10 * SEC) == 0
    assert plan.wait_ns(START_NS + SEC, 10 * SEC) == SEC
    plan.pause(12 * SEC)
    assert plan.position_ns(90 * SEC) == START_NS + 2 * SEC


def test_single_messages_are_due_while_paused() -> None:
    """The time of the bag moves to each message; `resume` cancels the steps that are left."""
    plan = schedule(is_paused=True)
    plan.step(2)
    assert plan.wait_ns(START_NS + SEC, 0) == 0
    plan.played(START_NS + SEC)
    assert plan.position_ns(0) == START_NS + SEC
    plan.played(START_NS + 3 * SEC)
    assert plan.wait_ns(START_NS + 4 * SEC, 0) is None
    plan.step(5)
    assert plan.steps == 5
    plan.forget_steps()
    assert plan.wait_ns(START_NS + 4 * SEC, 0) is None
    plan.step(5)
    plan.resume(SEC)
    assert plan.wait_ns(START_NS + 4 * SEC, SEC) == SEC
    plan.step(1)
    assert plan.wait_ns(START_NS + 4 * SEC, SEC) == SEC


def test_the_delay_comes_before_each_pass() -> None:
    """A pause interrupts the delay; its rest follows after `resume`."""
    plan = schedule(10, delay_ns=3 * SEC)
    assert plan.wait_ns(START_NS, SEC) == 2 * SEC
    assert plan.position_ns(SEC) == START_NS
    plan.set_rate(2, SEC)
    plan.pause(SEC)
    plan.resume(100 * SEC)
    assert plan.wait_ns(START_NS + 2 * SEC, 100 * SEC) == 3 * SEC
    plan.start_again(107 * SEC)
    assert plan.wait_ns(START_NS, 107 * SEC) == 3 * SEC


def test_passes_follow_each_other_without_drift() -> None:
    """A pass starts when the preceding one ended, not when the loop noticed, except after a long pause."""
    plan = schedule(10)
    plan.start_again(10 * SEC + 400)
    assert plan.wait_ns(START_NS + SEC, 10 * SEC + 400) == SEC - 400
    plan.start_again(100 * SEC)
    assert plan.wait_ns(START_NS + SEC, 100 * SEC) == SEC


def test_a_pass_starts_after_messages_behind_the_end() -> None:
    """By publish time, messages can be later than the bag's end; the next pass follows the last of them."""
    late_ns = START_NS + 10 * SEC + SEC // 2
    plan = schedule(10)
    assert plan.wait_ns(late_ns, 10 * SEC) == SEC // 2
    now_ns = 10 * SEC + SEC // 2 + 400
    plan.start_again(now_ns)
    assert plan.wait_ns(START_NS + SEC, now_ns) == SEC - 400
    plan.start_again(now_ns + 10 * SEC)
    assert plan.wait_ns(START_NS + SEC, now_ns + 10 * SEC) == SEC - 400
    assert plan.wait_ns(late_ns, now_ns + 10 * SEC) == 10 * SEC + SEC // 2 - 400
    plan.seek(START_NS + 9 * SEC, now_ns)
    plan.start_again(now_ns + SEC)
    assert plan.wait_ns(START_NS + SEC, now_ns + SEC) == SEC


@pytest.mark.parametrize(
    ("options", "begin_sec", "stop_sec"),
    [
        ({}, 0, 100),
        ({"start_offset_ns": 5 * SEC}, 5, 100),
        ({"start_offset_ns": 5 * SEC, "duration_ns": 2 * SEC}, 5, 7),
        ({"until_ns": START_NS + 9 * SEC}, 0, 9),
        ({"until_ns": START_NS + 9 * SEC, "duration_ns": 2 * SEC}, 0, 9),
        ({"until_ns": START_NS + 9 * SEC, "duration_ns": 20 * SEC}, 0, 20),
        ({"duration_ns": 1000 * SEC}, 0, 100),
        ({"until_ns": START_NS - 9 * SEC}, 0, -9),
    ],
)
def test_a_part_of_the_bag(options: dict[str, int], begin_sec: int, stop_sec: int) -> None:
    """An offset, a duration and an end time; the later end counts, as in ROS 2."""
    plan = schedule(**options)
    assert plan.begin_ns == START_NS + begin_sec * SEC
    assert plan.stop_ns == START_NS + stop_sec * SEC
    assert not plan.is_over(plan.stop_ns)
    assert plan.is_over(plan.end_ns + 1000 * SEC) == bool(options.keys() & {"duration_ns", "until_ns"})
    assert plan.wait_ns(plan.begin_ns + 1, 0) == 1


def test_seeking() -> None:
    """The time of the bag changes at once, paused or not."""
    plan = schedule()
    plan.seek(START_NS + 50 * SEC, SEC)
    assert plan.position_ns(2 * SEC) == START_NS + 51 * SEC
    assert plan.wait_ns(START_NS + 60 * SEC, 2 * SEC) == 9 * SEC
    plan.seek(START_NS + SEC, 2 * SEC)
    plan.pause(2 * SEC)
    plan.seek(START_NS + 2 * SEC, 3 * SEC)
    assert plan.position_ns(50 * SEC) == START_NS + 2 * SEC
    assert plan.has(START_NS)
    assert plan.has(START_NS + 100 * SEC)
    assert not plan.has(START_NS - 1)
    assert not plan.has(START_NS + 100 * SEC + 1)


def test_the_position_ends_with_the_bag() -> None:
    """The time of the bag stops at the end."""
    assert schedule().position_ns(1000 * SEC) == START_NS + 100 * SEC


@pytest.mark.parametrize("rate", [0, -1, float("nan"), float("inf"), 1e-300, 1e300])
def test_rates_that_are_none(rate: float) -> None:
    """Wrong rates are refused at the start and later, and the rate is unchanged."""
    with pytest.raises(InvalidBagOptionError, match="rate must be from"):
        schedule(rate=rate)
    plan = schedule()
    with pytest.raises(InvalidBagOptionError):
        plan.set_rate(rate, 0)
    assert plan.rate == 1


@pytest.mark.parametrize("name", ["start_offset_ns", "delay_ns"])
def test_negative_times(name: str) -> None:
    """They are refused."""
    with pytest.raises(InvalidBagOptionError, match="negative"):
        schedule(**{name: -1})
