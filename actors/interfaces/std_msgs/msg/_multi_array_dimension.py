"""std_msgs/msg/MultiArrayDimension."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class MultiArrayDimension(Message, type_name="std_msgs/msg/MultiArrayDimension"):
    """One dimension of an array."""

    label: str = ""
    """Name of the dimension, such as height or channel."""
    size: uint32 = 0
    """Number of entries along this dimension."""
    stride: uint32 = 0
    """Elements that one entry of the outer dimension spans: size times the stride of the next one."""
