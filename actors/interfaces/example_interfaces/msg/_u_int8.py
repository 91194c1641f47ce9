"""example_interfaces/msg/UInt8."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class UInt8(Message, type_name="example_interfaces/msg/UInt8"):
    """example_interfaces/msg/UInt8."""

    data: uint8 = 0
