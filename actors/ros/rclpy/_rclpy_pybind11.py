"""The errors of rclpy's C library that programs catch."""

from __future__ import annotations

from typing import TypeAlias

from actors.errors import NodeDestroyed

InvalidHandle: TypeAlias = NodeDestroyed


class RCLError(RuntimeError):
    """An argument or name is wrong, a context was shut down twice, or a goal's state allows no change."""


class UnknownROSArgsError(RuntimeError):
    """ROS 2 has no such argument after `--ros-args`."""


class TimerCancelledError(RCLError):
    """A timer that was cancelled cannot be called. callboard raises it nowhere: programs catch it."""


class NodeNameNonExistentError(RCLError):
    """There is no node of that name."""
