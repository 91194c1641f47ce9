"""std_msgs/msg/UInt32."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class UInt32(Message, type_name="std_msgs/msg/UInt32"):
    """One unsigned integer of 32 bits."""

    data: uint32 = 0
    """A whole number from 0 to 2^32 - 1."""
