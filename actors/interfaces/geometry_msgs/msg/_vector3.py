"""geometry_msgs/msg/Vector3."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Vector3(Message, type_name="geometry_msgs/msg/Vector3"):
    """geometry_msgs/msg/Vector3."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
