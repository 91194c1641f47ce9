"""std_msgs/msg/UInt64."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint64


class UInt64(Message, type_name="std_msgs/msg/UInt64"):
    """One unsigned integer of 64 bits."""

    data: uint64 = 0
    """A whole number from 0 to 2^64 - 1."""
