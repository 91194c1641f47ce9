"""Timers and rates, also while other threads use them."""

from __future__ import annotations

import sys
import threading
from typing import TYPE_CHECKING

from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.ros.rclpy.callback_groups import ReentrantCallbackGroup
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.qos import HistoryPolicy, QoSProfile
from actors.ros.rclpy.task import Future
from actors.ros.rclpy.timer import Timer
from actors.time.types import Time

if TYPE_CHECKING:
    import pytest

    from actors.ros.rclpy.context import Context

DEADLINE_SEC = 20.0


def test_timers_come_and_go_while_simulated_time_jumps(
    context: Context, caplog: pytest.LogCaptureFixture
) -> None:
    """The loop tells those that are there while a thread makes and drops others."""
    node = Node("node", context=context)
    node.set_parameters([Parameter("use_sim_time", value=True)])
    clock, done, interval = node.get_clock(), Future[None](), sys.getswitchinterval()
    publisher = node.create_publisher(ClockMessage, "/clock", QoSProfile(history=HistoryPolicy.KEEP_ALL))

    def advance() -> None:
        for number in range(1, 301):
            publisher.publish(ClockMessage(clock=Time(nanoseconds=number).to_msg()))
        publisher.wait_for_all_acked()
        done.set_result(None)

    timers = [node.create_timer(1000.0, None) for _ in range(100)]
    thread = threading.Thread(target=advance)
    sys.setswitchinterval(1e-6)
    try:
        thread.start()
        while not done.done():
            Timer(None, ReentrantCallbackGroup(), 1000, clock)
    finally:
        sys.setswitchinterval(interval)
        thread.join()
    assert len(timers) == 100
    assert not caplog.records


def test_a_rate_remembers_one_tick(context: Context) -> None:
    """A loop that has taken longer than its period does not sleep; the sleep after that does."""
    rate, seen = Node("node", context=context).create_rate(1000), list[str]()
    ticked = rate.timer.callback
    assert ticked is not None
    for _ in range(2):
        ticked()

    def sleep() -> None:
        for _ in range(2):
            rate.sleep()
            seen.append("slept")
            slept.release()

    slept = threading.Semaphore(0)
    thread = threading.Thread(target=sleep, daemon=True)
    thread.start()
    assert slept.acquire(timeout=DEADLINE_SEC)
    seen.append("ticks")
    ticked()
    while not slept.acquire(timeout=0.001):
        ticked()
    thread.join(DEADLINE_SEC)
    assert seen == ["slept", "ticks", "slept"]
