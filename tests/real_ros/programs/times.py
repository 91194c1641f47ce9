"""Points in time, durations and clocks."""

from __future__ import annotations

import builtin_interfaces.msg
from rclpy.clock import Clock, ClockType, ROSClock
from rclpy.duration import Duration, Infinite
from rclpy.time import Time

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node

NUMBERS = (0, 1, -1, 0.1, 1e-9, 1e-10, 2**62, 2**63 - 1, 2**63, -(2**63), None, True)


def _times(message):
    return [message.sec, message.nanosec]


def durations():
    """Make durations of seconds and of nanoseconds."""
    return [[outcome(_of, Duration, part, each) for part in ("seconds", "nanoseconds")] for each in NUMBERS]


def points():
    """Make points in time."""
    return [[outcome(_of, Time, part, each) for part in ("seconds", "nanoseconds")] for each in NUMBERS]


def fractions():
    """Make them of parts of nanoseconds, and of text."""
    return [outcome(_of, Duration, "nanoseconds", each) for each in (1.5, -1.5, "1")]


def _of(kind, part, number):
    return kind(**{part: number}).nanoseconds


def both_parts():
    """Make them of seconds and nanoseconds."""
    found = (
        Duration(seconds=1, nanoseconds=-1),
        Duration(seconds=-0.5, nanoseconds=10**9),
        Time(seconds=1.25, nanoseconds=5),
    )
    return [each.nanoseconds for each in found]


def messages():
    """Convert to messages and back."""
    numbers = (0, 1, -1, 1_500_000_000, -1_500_000_000, 2**31 * 10**9 - 1)
    durations = [Duration(nanoseconds=each).to_msg() for each in numbers]
    times = [Time(nanoseconds=each).to_msg() for each in numbers if each >= 0]
    return [
        [[*_times(each), Duration.from_msg(each).nanoseconds] for each in durations],
        [[*_times(each), Time.from_msg(each).nanoseconds] for each in times],
        outcome(lambda: _times(Duration(seconds=2**31).to_msg())),
        outcome(lambda: Time.from_msg(builtin_interfaces.msg.Time(sec=-1, nanosec=5)).nanoseconds),
        _times(Infinite.to_msg()),
    ]


def arithmetic():
    """Add and subtract."""
    time, duration = Time(seconds=10), Duration(seconds=3)
    expressions = (
        lambda: (time + duration).nanoseconds,
        lambda: (duration + time).nanoseconds,
        lambda: (time - duration).nanoseconds,
        lambda: (time - Time(seconds=12)).nanoseconds,
        lambda: type(time - time).__name__,
        lambda: (time + time).nanoseconds,
        lambda: (duration + duration).nanoseconds,
        lambda: (duration - duration).nanoseconds,
        lambda: (time + 1).nanoseconds,
        lambda: (Time(seconds=1) - Duration(seconds=2)).nanoseconds,
        lambda: (Time(nanoseconds=2**63 - 1) + Duration(nanoseconds=1)).nanoseconds,
        lambda: (time - Time(seconds=1, clock_type=ClockType.STEADY_TIME)).nanoseconds,
        lambda: (duration * 2).nanoseconds,
    )
    return [outcome(each) for each in expressions]


def comparison():
    """Compare with each other and with other things."""
    time, steady = Time(seconds=1), Time(seconds=1, clock_type=ClockType.STEADY_TIME)
    expressions = (
        lambda: time == Time(nanoseconds=10**9),
        lambda: time < Time(seconds=2),
        lambda: time < steady,
        lambda: time == 1,
        lambda: time < 1,
        lambda: Duration(seconds=1) == Duration(nanoseconds=10**9),
        lambda: Duration(seconds=1) == 1,
        lambda: Duration(seconds=1) < 2,
        lambda: Duration(seconds=1) == time,
        lambda: Duration(seconds=1) > Duration(seconds=0.5),
    )
    return [outcome(each) for each in expressions]


def times_of_two_clocks():
    """Compare times of two clocks."""
    time, steady = Time(seconds=1), Time(seconds=1, clock_type=ClockType.STEADY_TIME)
    return [outcome(lambda: time == steady), outcome(lambda: time != steady)]


def shown():
    """Show them."""
    things = (
        Time(seconds=1),
        Duration(seconds=1.5),
        Clock(),
        ROSClock(),
        Time(clock_type=ClockType.STEADY_TIME),
    )
    return [[type(each).__name__, repr(each)] for each in things if not isinstance(each, Clock)]


def clocks():
    """Make clocks of each type."""
    kinds = [ClockType.ROS_TIME, ClockType.SYSTEM_TIME, ClockType.STEADY_TIME]
    made = [Clock(clock_type=kind) for kind in kinds]
    return [
        [each.clock_type.name for each in made],
        [each.now().clock_type.name for each in made],
        [each.now() <= each.now() for each in made],
        type(Clock()).__name__,
        ROSClock().ros_time_is_active,
    ]


def clock_of_ros_time():
    """Make a clock of ROS time."""
    return isinstance(Clock(clock_type=ClockType.ROS_TIME), ROSClock)


def clock_of_a_node():
    """Ask the clock of a node, with simulated time and without."""

    def ask(*args):
        with running_node(*args) as node:
            clock = node.get_clock()
            return [clock.clock_type.name, clock.ros_time_is_active, clock.now().nanoseconds == 0]

    return [ask(), ask("-p", "use_sim_time:=true"), outcome(ask, "-p", "use_sim_time:=1")]
