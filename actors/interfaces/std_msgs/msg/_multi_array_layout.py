"""std_msgs/msg/MultiArrayLayout."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_dimension import MultiArrayDimension
from actors.interfaces.types import uint32


class MultiArrayLayout(Message, type_name="std_msgs/msg/MultiArrayLayout"):
    """How a flat list of elements forms an array of several dimensions."""

    dim: list[MultiArrayDimension] = msgspec.field(default_factory=list[MultiArrayDimension])
    """The dimensions, the slowest one first."""
    data_offset: uint32 = 0
    """Index of the first element in data; those before it are padding."""
