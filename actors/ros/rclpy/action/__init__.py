"""Actions: goals that take time."""

from __future__ import annotations

from actors.ros.rclpy.action.client import ActionClient as ActionClient
from actors.ros.rclpy.action.graph import (
    get_action_client_names_and_types_by_node as get_action_client_names_and_types_by_node,
)
from actors.ros.rclpy.action.graph import get_action_names_and_types as get_action_names_and_types
from actors.ros.rclpy.action.graph import (
    get_action_server_names_and_types_by_node as get_action_server_names_and_types_by_node,
)
from actors.ros.rclpy.action.server import ActionServer as ActionServer
from actors.ros.rclpy.action.server import CancelResponse as CancelResponse
from actors.ros.rclpy.action.server import GoalResponse as GoalResponse
