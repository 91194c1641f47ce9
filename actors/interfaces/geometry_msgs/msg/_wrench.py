"""geometry_msgs/msg/Wrench."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Wrench(Message, type_name="geometry_msgs/msg/Wrench"):
    """A force and a torque."""

    force: Vector3 = msgspec.field(default_factory=Vector3)
    """Force along x, y and z, in newtons."""
    torque: Vector3 = msgspec.field(default_factory=Vector3)
    """Torque about x, y and z, in newton metres."""
