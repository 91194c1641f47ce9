"""example_interfaces/msg/MultiArrayLayout."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_dimension import MultiArrayDimension
from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class MultiArrayLayout(Message, type_name="example_interfaces/msg/MultiArrayLayout"):
    """example_interfaces/msg/MultiArrayLayout."""

    dim: list[MultiArrayDimension] = msgspec.field(default_factory=list[MultiArrayDimension])
    data_offset: uint32 = 0
