"""Simulated time for tests: publishes `/clock`, and waits until nodes show it.

    simulated = SimulatedClock(driver, node)
    await simulated.set(100.0)
    await simulated.advance(0.5)

Time stands still between two calls; a node that starts to follow it meanwhile gets the current time. `driver`
and `node` run in this process; `node` has `use_sim_time` set.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.endpoints.events import PublisherEventCallbacks
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.time.clock import ros_time_of
from actors.time.types import ClockType, Duration, Time

if TYPE_CHECKING:
    from actors.endpoints.events import MatchedInfo
    from actors.node.node import Node


class SimulatedClock:
    """Drives the time of nodes.

    Args:
        driver: The node that publishes `/clock`.
        nodes: Nodes of this process that follow it: each step waits until their clocks show the new time.
        timeout_sec: How long a step may wait, in real time.
    """

    def __init__(self, driver: Node, *nodes: Node, timeout_sec: float = 10.0) -> None:
        self._nodes = nodes
        self._timeout_sec = timeout_sec
        self._now = Time(clock_type=ClockType.ROS_TIME)
        self._is_set = False
        self._publisher = driver.create_publisher(
            Clock, "/clock", 1, event_callbacks=PublisherEventCallbacks(matched=self._matched)
        )

    def now(self) -> Time:
        """Return the time that was set last; zero at first.

        Returns:
            The time, of ROS_TIME.
        """
        return self._now

    async def set(self, seconds: float | Time) -> None:
        """Set the time, which may be earlier than before.

        Args:
            seconds: The time, or seconds since 1970.

        Raises:
            TimeoutError: A node does not show it within `timeout_sec`; is its `use_sim_time` set?
            ValueError: The time is negative.
        """
        nanoseconds = seconds.nanoseconds if isinstance(seconds, Time) else Time(seconds=seconds).nanoseconds
        self._now = Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
        self._is_set = True
        async with asyncio.timeout(self._timeout_sec):
            self._publish()
            for node in self._nodes:
                await self._shown_by(node)

    async def advance(self, duration: float | Duration, *, step: float | Duration | None = None) -> None:
        """Advance the time, or set it back if the duration is negative.

        Args:
            duration: Seconds, or a Duration.
            step: Publish in steps of this length, as a simulator does; None is one step.

        Raises:
            TimeoutError: As for `set`.
            ValueError: The time would be negative, or the step is not positive.
        """
        left = _duration(duration)
        length = left if step is None else _duration(step)
        if step is not None and length.nanoseconds <= 0:
            raise ValueError("A step must be longer than zero")
        while step is not None and left > length:
            await self.set(self._now + length)
            left -= length
        await self.set(self._now + left)

    def _publish(self) -> None:
        self._publisher.publish(Clock(clock=self._now.to_msg()))

    def _matched(self, info: MatchedInfo) -> None:
        """Publish the time to a subscription that has missed it."""
        if self._is_set and info.total_count_change > 0:
            self._publish()

    async def _shown_by(self, node: Node) -> None:
        clock, received = node.get_clock(), asyncio.Event()
        ros_time = ros_time_of(clock)
        while not ros_time.known or clock.now() != self._now:
            received.clear()
            call = ros_time.call_at(0, received.set)  # at the next message: a first one may set the time to 0
            try:
                await received.wait()
            finally:
                call.cancel()


def _duration(value: float | Duration) -> Duration:
    return value if isinstance(value, Duration) else Duration(seconds=value)
