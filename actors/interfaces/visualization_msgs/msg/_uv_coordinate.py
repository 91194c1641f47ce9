"""visualization_msgs/msg/UVCoordinate."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class UVCoordinate(Message, type_name="visualization_msgs/msg/UVCoordinate"):
    """visualization_msgs/msg/UVCoordinate."""

    u: float32 = 0.0
    v: float32 = 0.0
