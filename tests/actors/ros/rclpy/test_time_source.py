"""Clocks without a node: a program or a time source sets them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.ros.rclpy.clock import Clock, JumpThreshold, ROSClock
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.time_source import CLOCK_TOPIC, TimeSource
from actors.time.types import ClockType, Duration, Time

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context


def simulated() -> tuple[TimeSource, ROSClock]:
    """Return a time source without a node, and the clock that it sets."""
    source, clock = TimeSource(), ROSClock()
    source.attach_clock(clock)
    source.ros_time_is_active = True
    return source, clock


def test_a_clock_shows_what_it_is_set_to() -> None:
    """It is zero at first, and the wall clock when it is not simulated any more."""
    source, clock = simulated()
    assert (clock.ros_time_is_active, clock.now().nanoseconds) == (True, 0)
    clock.set_ros_time_override(Time(seconds=5))
    assert clock.now() == Time(seconds=5, clock_type=ClockType.ROS_TIME)
    source.ros_time_is_active = False
    assert clock.now().nanoseconds > 10**18


def test_jump_callbacks_run_in_the_thread_that_sets_the_clock() -> None:
    """They may set the clock again, and what they raise is raised there."""
    _, clock = simulated()
    seen: list[int] = []
    threshold = JumpThreshold(min_forward=Duration(seconds=1), min_backward=None)

    def fail(jump: object) -> None:
        seen.append(clock.now().nanoseconds)
        clock.set_ros_time_override(Time(nanoseconds=7))
        raise LookupError(jump)

    with clock.create_jump_callback(threshold, post_callback=fail), pytest.raises(LookupError):
        clock.set_ros_time_override(Time(seconds=1))
    assert seen == [10**9]
    assert clock.now().nanoseconds == 7


def test_a_clock_that_is_not_simulated_does_not_jump() -> None:
    """The time that it is set to counts when it is."""
    source, clock = simulated()
    source.ros_time_is_active = False
    seen: list[object] = []
    threshold = JumpThreshold(min_forward=Duration(seconds=1), min_backward=None, on_clock_change=False)
    with clock.create_jump_callback(threshold, post_callback=seen.append):
        clock.set_ros_time_override(Time(seconds=9))
        source.ros_time_is_active = True
    assert (seen, clock.now().nanoseconds) == ([], 9 * 10**9)


def test_a_source_follows_the_parameter_and_the_clock_topic_of_a_node(context: Context) -> None:
    """While `use_sim_time` is set the clock shows what is published, then the wall clock again."""
    node, clock = Node("node", context=context), ROSClock()
    source = TimeSource(node=node)
    source.attach_clock(clock)
    assert not source.ros_time_is_active
    node.set_parameters([Parameter("use_sim_time", value=True)])
    assert (clock.ros_time_is_active, clock.now().nanoseconds) == (True, 0)
    publisher = node.create_publisher(ClockMessage, CLOCK_TOPIC, 10)
    shown = Time(seconds=3, clock_type=ClockType.ROS_TIME)
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        while clock.now() != shown:
            publisher.publish(ClockMessage(clock=shown.to_msg()))
            executor.spin_once(0.05)
    node.set_parameters([Parameter("use_sim_time", value=False)])
    assert clock.now().nanoseconds > 10**18
    source.detach_node()


def test_what_is_no_clock_or_no_time_is_refused() -> None:
    """Each error says what is wrong."""
    wrong: Any = "STEADY_TIME"
    with pytest.raises(TypeError, match="must be a ClockType"):
        Clock(clock_type=wrong)
    with pytest.raises(TypeError, match="is a ClockType"):
        Time(clock_type=wrong)
    with pytest.raises(TypeError, match="set to an"):
        ROSClock().set_ros_time_override(wrong)
    steady: Any = Clock(clock_type=ClockType.STEADY_TIME)
    with pytest.raises(ValueError, match="only clocks of ROS time"):
        TimeSource().attach_clock(steady)
    with pytest.raises(TypeError, match="follows an"):
        TimeSource(node=wrong)
