"""Loggers of launch files."""

from __future__ import annotations

from logging import handlers as handlers
from types import SimpleNamespace
from typing import Final

from actors.ros.rclpy.logging import get_logger as get_logger

launch_config: Final = SimpleNamespace()
"""Accepts the settings of ROS 2's log files and ignores them: callboard writes its own log files."""
