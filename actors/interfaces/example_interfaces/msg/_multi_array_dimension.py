"""example_interfaces/msg/MultiArrayDimension."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class MultiArrayDimension(Message, type_name="example_interfaces/msg/MultiArrayDimension"):
    """example_interfaces/msg/MultiArrayDimension."""

    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0
