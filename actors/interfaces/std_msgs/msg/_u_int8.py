"""std_msgs/msg/UInt8."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class UInt8(Message, type_name="std_msgs/msg/UInt8"):
    """One unsigned integer of 8 bits."""

    data: uint8 = 0
    """A whole number from 0 to 255."""
