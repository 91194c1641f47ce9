"""std_msgs/msg/ColorRGBA."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class ColorRGBA(Message, type_name="std_msgs/msg/ColorRGBA"):
    """std_msgs/msg/ColorRGBA."""

    r: float32 = 0.0
    g: float32 = 0.0
    b: float32 = 0.0
    a: float32 = 0.0
