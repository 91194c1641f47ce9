"""Simulated time for tests: publishes `/clock`, and waits until nodes show it.

    simulated = SimulatedClock(driver, node)
    await simulated.set(100.0)
    await simulated.advance(0.5)

Time stands still between two calls. `driver` and `node` run in this process; `node` has `use_sim_time` set.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from actors.endpoints.events import PublisherEventCallbacks
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.time.jumps import JumpThreshold
from actors.time.types import ClockType, Duration, Time

if TYPE_CHECKING:
    from actors.node.node import Node

_ANY_JUMP: Final = JumpThreshold(
    min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1), on_clock_change=True
)


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
        self._matched = asyncio.Event()
        self._publisher = driver.create_publisher(
            Clock, "/clock", 1, event_callbacks=PublisherEventCallbacks(matched=lambda _: self._matched.set())
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
        async with asyncio.timeout(self._timeout_sec):
            while self._publisher.get_subscription_count() < len(self._nodes):
                self._matched.clear()
                await self._matched.wait()
            self._publisher.publish(Clock(clock=self._now.to_msg()))
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

    async def _shown_by(self, node: Node) -> None:
        clock, jumped = node.get_clock(), asyncio.Event()
        with clock.create_jump_callback(_ANY_JUMP, post_callback=lambda _: jumped.set()):
            while clock.now() != self._now:
                jumped.clear()
                await jumped.wait()


def _duration(value: float | Duration) -> Duration:
    return value if isinstance(value, Duration) else Duration(seconds=value)
