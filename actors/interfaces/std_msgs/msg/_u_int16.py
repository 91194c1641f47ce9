"""std_msgs/msg/UInt16."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint16


class UInt16(Message, type_name="std_msgs/msg/UInt16"):
    """std_msgs/msg/UInt16."""

    data: uint16 = 0
