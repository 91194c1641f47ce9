"""geometry_msgs/msg/Point."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Point(Message, type_name="geometry_msgs/msg/Point"):
    """geometry_msgs/msg/Point."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
