"""geometry_msgs/msg/Accel."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Accel(Message, type_name="geometry_msgs/msg/Accel"):
    """geometry_msgs/msg/Accel."""

    linear: Vector3 = msgspec.field(default_factory=Vector3)
    angular: Vector3 = msgspec.field(default_factory=Vector3)
