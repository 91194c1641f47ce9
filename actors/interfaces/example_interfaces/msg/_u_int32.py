"""example_interfaces/msg/UInt32."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class UInt32(Message, type_name="example_interfaces/msg/UInt32"):
    """example_interfaces/msg/UInt32."""

    data: uint32 = 0
