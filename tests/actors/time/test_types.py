"""Times and durations: what they are made of, and how they are added and compared."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.builtin_interfaces import msg
from actors.time.types import ClockType, Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable

SECOND = 1_000_000_000
NO_NUMBER: Any = "SYSTEM_TIME"


def test_durations_are_added_multiplied_and_compared() -> None:
    """As numbers of nanoseconds; a float is rounded."""
    span = Duration(seconds=1.5)
    assert span + Duration(nanoseconds=1) == Duration(nanoseconds=1_500_000_001)
    assert span - Duration(seconds=2) == -Duration(seconds=0.5) == Duration(seconds=-0.5)
    assert (span * 2, 0.5 * span) == (Duration(seconds=3), Duration(seconds=0.75))
    assert Duration(seconds=1) < span <= Duration(seconds=1.5)
    assert len({span, Duration(seconds=1.5), Duration()}) == 2
    assert span != SECOND * 1.5


def test_times_are_moved_by_durations() -> None:
    """The difference of two times is a duration, and a time keeps its kind of clock."""
    start = Time(seconds=5, clock_type=ClockType.ROS_TIME)
    later = start + Duration(seconds=2)
    assert (later.nanoseconds, later.clock_type) == (7 * SECOND, ClockType.ROS_TIME)
    assert later == Duration(seconds=2) + start
    assert (later - start, later - Duration(seconds=2)) == (Duration(seconds=2), start)
    assert start < later
    assert start != Time(seconds=5)
    assert start != 5 * SECOND
    assert len({start, Time(seconds=5, clock_type=ClockType.ROS_TIME), later}) == 2
    assert repr(start) == "Time(nanoseconds=5000000000, clock_type=ROS_TIME)"


def test_messages_have_whole_seconds_and_the_rest() -> None:
    """Also of a negative duration, whose seconds are rounded down."""
    assert Time(nanoseconds=SECOND + 7).to_msg() == msg.Time(sec=1, nanosec=7)
    assert Duration(nanoseconds=-1).to_msg() == msg.Duration(sec=-1, nanosec=SECOND - 1)
    assert Duration.from_msg(msg.Duration(sec=-1, nanosec=SECOND - 1)) == Duration(nanoseconds=-1)
    assert Time.from_msg(msg.Time(sec=1, nanosec=7)) == Time(
        nanoseconds=SECOND + 7, clock_type=ClockType.ROS_TIME
    )


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.lt, operator.mul])
@pytest.mark.parametrize("left", [Time(seconds=1), Duration(seconds=1)])
def test_what_is_no_time_is_refused(operation: Callable[[Any, Any], object], left: object) -> None:
    """A TypeError, as between other things that do not fit."""
    with pytest.raises(TypeError):
        operation(left, "1")


@pytest.mark.parametrize("operation", [operator.sub, operator.lt])
def test_times_of_different_clocks_have_no_difference(operation: Callable[[Any, Any], object]) -> None:
    """A steady clock counts from any zero."""
    with pytest.raises(TypeError, match="SYSTEM_TIME and STEADY_TIME"):
        operation(Time(seconds=1), Time(seconds=1, clock_type=ClockType.STEADY_TIME))


@pytest.mark.parametrize(
    ("made", "error"),
    [
        (lambda: Time(seconds=-1, nanoseconds=2 * SECOND), ValueError),
        (lambda: Time(nanoseconds=-1), ValueError),
        (lambda: Duration(seconds=math.inf), ValueError),
        (lambda: Duration(nanoseconds=2**63), OverflowError),
        (lambda: ClockType(NO_NUMBER), TypeError),
    ],
)
def test_what_does_not_fit_is_refused(made: Callable[[], object], error: type[Exception]) -> None:
    """Negative times, what is not finite, more than 64 bits, and what is no kind of clock."""
    with pytest.raises(error):
        made()
