"""geometry_msgs/msg/Accel."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Accel(Message, type_name="geometry_msgs/msg/Accel"):
    """A linear and an angular acceleration."""

    linear: Vector3 = msgspec.field(default_factory=Vector3)
    """Linear acceleration along x, y and z, in m/s^2."""
    angular: Vector3 = msgspec.field(default_factory=Vector3)
    """Angular acceleration about x, y and z, in rad/s^2."""
