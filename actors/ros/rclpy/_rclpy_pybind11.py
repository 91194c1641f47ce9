"""Of rclpy's C library, the errors that programs catch."""

from __future__ import annotations

from actors.ros.rclpy.exceptions import InvalidHandle as InvalidHandle


class RCLError(RuntimeError):
    """A context has been shut down twice."""
