"""std_msgs/msg/Int8."""

from actors.interfaces.message import Message
from actors.interfaces.types import int8


class Int8(Message, type_name="std_msgs/msg/Int8"):
    """std_msgs/msg/Int8."""

    data: int8 = 0
