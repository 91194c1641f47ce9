"""The errors of rclpy's C library that programs catch."""

from __future__ import annotations

from actors.ros.rclpy.exceptions import InvalidHandle as InvalidHandle


class RCLError(RuntimeError):
    """An argument or name is wrong, a context was shut down twice, or a goal's state allows no change."""


class UnknownROSArgsError(RuntimeError):
    """ROS 2 has no such argument after `--ros-args`."""


class NodeNameNonExistentError(RCLError):
    """There is no node of that name."""
