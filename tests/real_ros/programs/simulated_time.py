"""Clocks that a program sets itself, and what follows them."""

from __future__ import annotations

import threading

from rclpy.clock import Clock, ClockType, JumpThreshold, ROSClock
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.time_source import TimeSource
from rosgraph_msgs.msg import Clock as ClockMessage

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until


def _active(clock, is_active):
    clock._set_ros_time_is_active(is_active)  # noqa: SLF001 - the one way, and what upstream's tests do
    return clock


def _set(clock, seconds):
    clock.set_ros_time_override(Time(seconds=seconds))


def clock_that_is_set():
    """Set a clock before, while and after it is simulated."""
    clock, seen = ROSClock(), []

    def look():
        now = clock.now().nanoseconds
        seen.append([clock.ros_time_is_active, now if now < 10**12 else "wall"])

    look()
    _active(clock, True)
    look()
    _set(clock, 5)
    look()
    _active(clock, False)
    look()
    _set(clock, 7)
    look()
    _active(clock, True)
    look()
    _set(clock, 2)
    look()
    return seen


def jumps():
    """Set a clock with jump callbacks of several thresholds."""
    second = Duration(seconds=1)
    thresholds = (
        JumpThreshold(min_forward=second, min_backward=Duration(seconds=-0.5), on_clock_change=False),
        JumpThreshold(min_forward=Duration(seconds=0.5), min_backward=None, on_clock_change=False),
        JumpThreshold(min_forward=None, min_backward=None, on_clock_change=True),
    )
    clock, seen = ROSClock(), []

    def register(number, threshold):
        def after(jump):
            seen.append([number, jump.clock_change.name, jump.delta.nanoseconds])

        return clock.create_jump_callback(threshold, post_callback=after)

    handles = [register(*each) for each in enumerate(thresholds)]
    _set(clock, 1)
    for is_active in (True, True, False, True):
        _active(clock, is_active)
    for seconds in (1.75, 3, 2.75, 1):
        _set(clock, seconds)
    for each in handles:
        each.unregister()
    _set(clock, 100)
    return seen


def thread_of_jump_callbacks():
    """Set a clock with a callback that reads it."""
    clock, seen = _active(ROSClock(), True), []
    threshold = JumpThreshold(min_forward=Duration(seconds=1), min_backward=None)
    with clock.create_jump_callback(
        threshold, post_callback=lambda jump: seen.append([clock.now().nanoseconds, threading.get_ident()])
    ):
        _set(clock, 5)
    return [[now, thread == threading.get_ident()] for now, thread in seen]


def wrong_arguments():
    """Make and set clocks with what is none."""
    return [
        outcome(lambda: Clock(clock_type="STEADY_TIME")),
        outcome(lambda: Clock(clock_type=1)),
        outcome(lambda: Time(clock_type="SYSTEM_TIME")),
        outcome(lambda: ROSClock().set_ros_time_override(5)),
        outcome(lambda: ROSClock().set_ros_time_override(Time(seconds=1, clock_type=ClockType.ROS_TIME))),
    ]


def sleep_until_the_clock_is_set():
    """Sleep by a clock until another thread sets it."""
    context, clock = Context(), _active(ROSClock(), True)
    context.init()
    _set(clock, 1)
    until, slept = Time(seconds=11, clock_type=ClockType.ROS_TIME), []
    thread = threading.Thread(target=lambda: slept.append(clock.sleep_until(until, context)))
    thread.start()
    _set(clock, 11)
    thread.join()
    context.shutdown()
    return slept


def timer_of_a_clock_that_is_set():
    """Give a timer a clock, and set that."""
    with running_node() as node:
        clock, seen = _active(ROSClock(), True), []
        _set(clock, 10)
        node.create_timer(1.0, lambda: seen.append(clock.now().nanoseconds), clock=clock)
        for seconds in (11, 12.5):
            _set(clock, seconds)
            spin_until(node, lambda: seen and seen[-1] == clock.now().nanoseconds)
        return seen


def time_source():
    """Let a time source set clocks, by a node's parameter and its `/clock`."""
    with running_node() as node:
        source, clock = TimeSource(node=node), ROSClock()
        source.attach_clock(clock)
        publisher = node.create_publisher(ClockMessage, "/clock", 1)
        seen = [[source.ros_time_is_active, clock.ros_time_is_active]]
        node.set_parameters([Parameter("use_sim_time", value=True)])
        seen.append([source.ros_time_is_active, clock.ros_time_is_active, clock.now().nanoseconds])
        message = ClockMessage()
        message.clock.sec = 5
        spin_until(node, lambda: publisher.publish(message) or clock.now().nanoseconds)
        later = ROSClock()
        source.attach_clock(later)
        seen.append([clock.now().nanoseconds, later.now().nanoseconds, later.ros_time_is_active])
        source.clock_callback(ClockMessage())
        seen.append([clock.now().nanoseconds, later.now().nanoseconds])
        source.ros_time_is_active = False
        seen.append([clock.ros_time_is_active, later.ros_time_is_active])
        source.detach_node()
        node.set_parameters([Parameter("use_sim_time", value=False)])
        return [
            *seen,
            outcome(source.attach_clock, Clock()),
            outcome(source.attach_node, 5),
            outcome(TimeSource().attach_clock, ROSClock()),
        ]
