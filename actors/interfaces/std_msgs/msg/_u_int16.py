"""std_msgs/msg/UInt16."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint16


class UInt16(Message, type_name="std_msgs/msg/UInt16"):
    """One unsigned integer of 16 bits."""

    data: uint16 = 0
    """A whole number from 0 to 65535."""
