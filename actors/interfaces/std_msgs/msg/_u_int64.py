"""std_msgs/msg/UInt64."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint64


class UInt64(Message, type_name="std_msgs/msg/UInt64"):
    """std_msgs/msg/UInt64."""

    data: uint64 = 0
