"""`launch_ros` for launch files written for ROS 2: the classes of `actors.launch`, with ROS 2's arguments.

Imports `actors.launch`, `actors.ros.launch` and what is below them.
"""

from __future__ import annotations

from actors.ros.launch_ros import (
    actions as actions,
    descriptions as descriptions,
    event_handlers as event_handlers,
    events as events,
    parameter_descriptions as parameter_descriptions,
    substitutions as substitutions,
)
