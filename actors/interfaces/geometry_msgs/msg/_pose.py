"""geometry_msgs/msg/Pose."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.message import Message


class Pose(Message, type_name="geometry_msgs/msg/Pose"):
    """A position and an orientation in space."""

    position: Point = msgspec.field(default_factory=Point)
    """Position, in metres."""
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)
    """Rotation, as a unit quaternion."""
