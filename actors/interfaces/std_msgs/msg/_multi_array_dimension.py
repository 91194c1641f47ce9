"""std_msgs/msg/MultiArrayDimension."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class MultiArrayDimension(Message, type_name="std_msgs/msg/MultiArrayDimension"):
    """std_msgs/msg/MultiArrayDimension."""

    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0
