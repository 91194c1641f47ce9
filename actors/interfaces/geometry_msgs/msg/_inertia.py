"""geometry_msgs/msg/Inertia."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Inertia(Message, type_name="geometry_msgs/msg/Inertia"):
    """geometry_msgs/msg/Inertia."""

    m: float64 = 0.0
    com: Vector3 = msgspec.field(default_factory=Vector3)
    ixx: float64 = 0.0
    ixy: float64 = 0.0
    ixz: float64 = 0.0
    iyy: float64 = 0.0
    iyz: float64 = 0.0
    izz: float64 = 0.0
