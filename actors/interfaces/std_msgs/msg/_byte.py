"""std_msgs/msg/Byte."""

from actors.interfaces.message import Message
from actors.interfaces.types import byte


class Byte(Message, type_name="std_msgs/msg/Byte"):
    """std_msgs/msg/Byte."""

    data: byte = b"\x00"
