"""nav_msgs/msg/Trajectory."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.nav_msgs.msg._trajectory_point import TrajectoryPoint
from actors.interfaces.std_msgs.msg._header import Header


class Trajectory(Message, type_name="nav_msgs/msg/Trajectory"):
    """A motion as a list of points in time."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the trajectory was made, and the frame of its points."""
    points: list[TrajectoryPoint] = msgspec.field(default_factory=list[TrajectoryPoint])
    """Points along the trajectory, in the order of their times."""
