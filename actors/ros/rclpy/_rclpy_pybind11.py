"""The errors of rclpy's C library that programs catch."""

from __future__ import annotations

from actors.ros.rclpy.exceptions import InvalidHandle as InvalidHandle


class RCLError(RuntimeError):
    """A context has been shut down twice, or the state of a goal does not allow a change."""
