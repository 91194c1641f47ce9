"""example_interfaces/msg/UInt16."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint16


class UInt16(Message, type_name="example_interfaces/msg/UInt16"):
    """example_interfaces/msg/UInt16."""

    data: uint16 = 0
