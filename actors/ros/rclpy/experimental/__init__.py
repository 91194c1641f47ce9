"""What rclpy tries out."""

from __future__ import annotations

from actors.ros.rclpy.experimental.events_executor import EventsExecutor as EventsExecutor
