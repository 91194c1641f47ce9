"""geometry_msgs/msg/Pose."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.message import Message


class Pose(Message, type_name="geometry_msgs/msg/Pose"):
    """geometry_msgs/msg/Pose."""

    position: Point = msgspec.field(default_factory=Point)
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)
