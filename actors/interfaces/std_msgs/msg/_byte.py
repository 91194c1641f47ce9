"""std_msgs/msg/Byte."""

from actors.interfaces.message import Message
from actors.interfaces.types import byte


class Byte(Message, type_name="std_msgs/msg/Byte"):
    """One byte."""

    data: byte = b"\x00"
    """One byte, without a meaning of its own."""
