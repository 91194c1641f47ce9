"""Actions: goals that take time."""

from __future__ import annotations

from actors.ros.rclpy.action.client import ActionClient as ActionClient
from actors.ros.rclpy.action.server import ActionServer as ActionServer
from actors.ros.rclpy.action.server import CancelResponse as CancelResponse
from actors.ros.rclpy.action.server import GoalResponse as GoalResponse
