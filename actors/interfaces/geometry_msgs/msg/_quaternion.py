"""geometry_msgs/msg/Quaternion."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Quaternion(Message, type_name="geometry_msgs/msg/Quaternion"):
    """geometry_msgs/msg/Quaternion."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0
