"""geometry_msgs/msg/Twist."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Twist(Message, type_name="geometry_msgs/msg/Twist"):
    """A linear and an angular velocity, as on /cmd_vel."""

    linear: Vector3 = msgspec.field(default_factory=Vector3)
    """Velocity along x, y and z, in m/s."""
    angular: Vector3 = msgspec.field(default_factory=Vector3)
    """Angular velocity about x, y and z, in rad/s."""
