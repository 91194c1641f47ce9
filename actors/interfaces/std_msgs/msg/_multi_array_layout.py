"""std_msgs/msg/MultiArrayLayout."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_dimension import MultiArrayDimension
from actors.interfaces.types import uint32


class MultiArrayLayout(Message, type_name="std_msgs/msg/MultiArrayLayout"):
    """std_msgs/msg/MultiArrayLayout."""

    dim: list[MultiArrayDimension] = msgspec.field(default_factory=list[MultiArrayDimension])
    data_offset: uint32 = 0
