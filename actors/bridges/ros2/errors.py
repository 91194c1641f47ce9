"""Errors of the edge to ROS 2.

CallboardError (proto.errors)
├── RosNotFoundError    ROS 2 cannot be used in this process; the text says what to do
├── RosError            ROS 2 refuses a name, an entity or a call
├── SuspendedError      the process has not run for so long that ROS 2 has dropped it
└── UnknownTypeError    one side does not have a type, or has another of this name
"""

from __future__ import annotations

from proto.errors import CallboardError


class RosNotFoundError(CallboardError):
    """ROS 2 cannot be used in this process; the text says why, and what to do."""


class RosError(CallboardError):
    """ROS 2 refuses a name, an entity or a call; the text says which and why."""


class UnknownTypeError(CallboardError, LookupError):
    """One side does not have a type, or has another of this name; the text says what to do."""


class SuspendedError(CallboardError):
    """The process has not run for so long that ROS 2 has dropped its participant.

    Participants that had not dropped each other at the same time do not tell each other the names of their
    nodes again.
    """
