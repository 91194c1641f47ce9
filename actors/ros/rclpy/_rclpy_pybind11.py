"""The parts of rclpy's C library that programs use: errors to catch, and a name."""

from __future__ import annotations

from typing import TypeAlias

from actors.errors import NodeDestroyed

InvalidHandle: TypeAlias = NodeDestroyed


class RCLError(RuntimeError):
    """An argument or name is wrong, a context was shut down twice, or a goal's state allows no change."""


class RCLInvalidROSArgsError(RCLError):
    """An argument after `--ros-args` lacks its value, or has a wrong one."""


class UnknownROSArgsError(RuntimeError):
    """ROS 2 has no such argument after `--ros-args`."""


class TimerCancelledError(RCLError):
    """A timer that was cancelled cannot be called. callboard raises it nowhere: programs catch it."""


class NodeNameNonExistentError(RCLError):
    """There is no node of that name."""


def rclpy_get_rmw_implementation_identifier() -> str:
    """Return what carries the messages."""
    return "callboard"
