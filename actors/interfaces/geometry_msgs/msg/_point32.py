"""geometry_msgs/msg/Point32."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class Point32(Message, type_name="geometry_msgs/msg/Point32"):
    """geometry_msgs/msg/Point32."""

    x: float32 = 0.0
    y: float32 = 0.0
    z: float32 = 0.0
