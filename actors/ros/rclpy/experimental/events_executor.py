"""The executor that rclpy offers beside its others, which look at all entities after each wake-up."""

from __future__ import annotations

from actors.ros.rclpy.executors import SingleThreadedExecutor


class EventsExecutor(SingleThreadedExecutor):
    """Runs callbacks in the thread that spins. All executors of callboard wait for events."""
