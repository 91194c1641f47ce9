"""geometry_msgs/msg/Wrench."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Wrench(Message, type_name="geometry_msgs/msg/Wrench"):
    """geometry_msgs/msg/Wrench."""

    force: Vector3 = msgspec.field(default_factory=Vector3)
    torque: Vector3 = msgspec.field(default_factory=Vector3)
